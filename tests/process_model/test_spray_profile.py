"""A gun's profile against its own integrals."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process_model.spray_profile import SprayProfile

PROFILES = (
    SprayProfile(0.10, 0.03, 2e-6, 0.2, across_exponent=2.3, along_exponent=3.1),
    SprayProfile(0.04, 0.015, 2e-6, 0.2, "gaussian"),
)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_flux_adds_up_to_the_flow_and_its_lines_to_the_strip(profile):
    across, along = (np.linspace(-end, end, 1501) for end in profile.ends_m)
    x, y = np.meshgrid(across, along, indexing="ij")
    flux = profile.flux(x.ravel(), y.ravel()).reshape(x.shape)
    dx, dy = across[1] - across[0], along[1] - along[0]
    assert flux.sum() * dx * dy == pytest.approx(profile.flow_m3_s, rel=2e-3)
    assert flux.sum(axis=1) * dy / 0.25 == pytest.approx(
        profile.strip(across, 0.25), rel=2e-3, abs=1e-3 * profile.strip(0.0, 0.25)
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"across_m": 0.0}, "across_m of 0; give"),
        ({"along_m": float("nan")}, "along_m of nan"),
        ({"flow_m3_s": 0.0}, "flow_m3_s of 0"),
        ({"along_exponent": 0.5}, "along_exponent of 0.5"),
        ({"shape": "round"}, "beta or gaussian"),
    ],
)
def test_a_profile_that_no_gun_has_is_refused(change, said):
    with pytest.raises(ProcessError, match=said):
        SprayProfile(**{"across_m": 0.1, "along_m": 0.1, "flow_m3_s": 1e-6, "standoff_m": 0.2}
                     | change)  # fmt: skip
