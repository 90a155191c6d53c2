"""Keys of a tool."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from nrdf.process.tool_keys import Tool

GUN = {"radius_mm": 60, "profile": {"across_mm": 50, "along_mm": 40, "flow_mm3_s": 400}}


def test_a_gun_and_a_pad_in_the_units_that_people_use():
    profile = Tool.model_validate(GUN).profile
    assert (profile.across_m, profile.flow_m3_s, profile.shape) == (0.05, 4e-7, "beta")
    pad = Tool.model_validate({"radius_mm": 60, "pad": {"preston_per_pa": 5e-9, "orbit_mm": 2}}).pad
    assert (pad.orbit_m, pad.stiffness_n_m3) == (0.002, 2e7)


@pytest.mark.parametrize("key", ["across_mm", "along_mm", "flow_mm3_s"])
def test_a_profile_of_zero_width_or_flow_is_refused(key):
    wrong = {**GUN, "profile": {**GUN["profile"], key: 0}}
    with pytest.raises(ValidationError, match="greater than 0"):
        Tool.model_validate(wrong)
