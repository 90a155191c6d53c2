"""A profile from measured strips."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process_model.profile_fit import Strip, fit_profile, read_strip
from nrdf.process_model.spray_profile import SprayProfile

GUN = SprayProfile(0.09, 0.04, 3e-6, 0.2, across_exponent=2.4, along_exponent=3.2)
OFFSETS = np.linspace(-0.12, 0.12, 49)


def strip(profile, noise=0.0, feed=0.3):
    rng = np.random.default_rng(0)
    film = profile.strip(OFFSETS - 0.01, feed)
    return Strip(OFFSETS, film * (1.0 + noise * rng.normal(size=len(film))), feed)


def turned(profile):
    return SprayProfile(profile.along_m, profile.across_m, profile.flow_m3_s, profile.standoff_m,
                        profile.shape, profile.along_exponent, profile.across_exponent)  # fmt: skip


def test_a_gun_is_found_again_from_its_two_strips():
    found = fit_profile(strip(GUN), 0.2, along=strip(turned(GUN)))
    assert found.error < 1e-4 and found.middle_m == pytest.approx(0.01, abs=1e-5)
    for name in ("across_m", "along_m", "flow_m3_s", "across_exponent", "along_exponent"):
        assert getattr(found.profile, name) == pytest.approx(getattr(GUN, name), rel=0.01), name


def test_noise_of_a_gauge_moves_the_flow_by_a_per_cent_at_most():
    found = fit_profile(strip(GUN, 0.03), 0.2, roundness=4 / 9)
    assert found.profile.flow_m3_s == pytest.approx(GUN.flow_m3_s, rel=0.01)
    assert found.profile.along_m == pytest.approx(found.profile.across_m * 4 / 9)


def test_a_gaussian_gun():
    gun = SprayProfile(0.03, 0.03, 3e-6, 0.2, "gaussian")
    found = fit_profile(strip(gun), 0.2, "gaussian").profile
    assert found.across_m == pytest.approx(0.03, rel=0.01)
    assert found.flow_m3_s == pytest.approx(3e-6, rel=0.01)


def test_a_file_is_read_and_a_wrong_one_is_answered(tmp_path):
    file = tmp_path / "strip.csv"
    rows = "".join(f"{1e3 * x},{1e6 * t}\n" for x, t in zip(OFFSETS, strip(GUN).thickness_m,
                                                            strict=True))  # fmt: skip
    file.write_text("# gauge 7\noffset_mm, thickness_um\n" + rows)
    assert read_strip(file, 0.3).thickness_m == pytest.approx(strip(GUN).thickness_m)
    for text, said in (
        ("x,y\n1,2\n", "columns x, y; a measured strip needs offset_mm and thickness_um"),
        ("offset_mm,thickness_um\n1,much\n", "row 2: '1', 'much' are no two numbers"),
        ("offset_mm,thickness_um\n1,nan\n", "must be finite"),
        ("offset_mm,thickness_um\n1,2\n2,0\n", "film at 1 offsets; a profile needs 6"),
        ("", "columns of no name"),
    ):
        file.write_text(text)
        with pytest.raises(ProcessError, match=said):
            read_strip(file, 0.3)
    with pytest.raises(ProcessError, match="a roundness of 0"):
        fit_profile(strip(GUN), 0.2, roundness=0.0)


def test_a_strip_around_zero():
    film = GUN.strip(OFFSETS, 0.3)
    found = fit_profile(Strip(OFFSETS, film, 0.3), 0.2)
    assert found.middle_m == pytest.approx(0.0, abs=1e-6) and found.error < 1e-4
