"""Keys of a process for its result."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from nrdf.process.process import Process
from nrdf.process.result_keys import Amount, FeedLimitKeys

GUN = {"radius_m": 0.05, "profile": {"across_mm": 50, "along_mm": 40, "flow_mm3_s": 400}}
PAINT = {"kind": "paint", "tool": GUN, "stepover_mm": 40, "standoff_mm": 150, "feed_mm_s": 300}
DISC = {"radius_m": 0.05, "pad": {"preston_per_pa": 5e-9, "orbit_mm": 2.5}}
SAND = {"kind": "sand", "tool": DISC, "stepover_mm": 30, "feed_mm_s": 100, "force_n": 20,
        "spindle_rpm": 9000}  # fmt: skip


@pytest.mark.parametrize("text", ["60 ± 10", "60±10", "60 +/- 10", " 60.0 +- 10 um", "60 ± 10 µm"])
def test_an_amount_is_read_as_people_write_it(text):
    found = Process.model_validate({**PAINT, "thickness_um": text}).thickness_um
    assert (found.value, found.tolerance) == (60.0, 10.0)
    assert found == Amount(value=60, tolerance=10)


@pytest.mark.parametrize(
    ("base", "change", "said"),
    [
        (PAINT, {"thickness_um": "60"}, "'60' is no amount with a tolerance; write it as 60 ± 10"),
        (PAINT, {"thickness_um": 60}, "no amount with a tolerance"),
        (PAINT, {"thickness_um": "60 ± 0"}, "tolerance\n.*greater than 0"),
        (PAINT, {"thickness_um": "10 ± 10"}, "a tolerance of 10 on 10; it must be below"),
        (PAINT, {"thickness_um": {"value": 9, "tolerance": 1, "most": 5}}, "most is 5, less than"),
        (PAINT, {"thickness_um": "6 ± 1", "removal_um": "6 ± 1"}, "not both"),
        (PAINT, {"thickness_um": "6 ± 1", "tool": {"radius_m": 0.05}}, "needs tool.profile"),
        (PAINT, {"thickness_um": "6 ± 1", "standoff_mm": 0}, "needs standoff_m"),
        (SAND, {"removal_um": "6 ± 1", "force_n": None}, "needs tool.pad and force_n"),
        (SAND, {"removal_um": "6 ± 1", "tool": {"radius_m": 0.05}}, "needs tool.pad"),
        (PAINT, {"tool": {**GUN, "profile": {**GUN["profile"], "across_mm": 0}}},
         "greater than 0"),
        (SAND, {"feed_limits": {"least_mm_s": 200, "most_mm_s": 100}}, "more than most_m_s"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_answered(base, change, said):
    with pytest.raises(ValidationError, match=said):
        Process.model_validate({**base, **change})


def test_limits_on_feed_may_be_given_in_millimetres():
    assert FeedLimitKeys.model_validate({"most_mm_s": 250}).most_m_s == 0.25
