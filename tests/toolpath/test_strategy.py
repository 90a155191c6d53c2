from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.toolpath.planners import PLANNERS
from nrdf.toolpath.strategy import TRAJECTORIES, Strategy, Trajectory


def test_every_trajectory_is_taken():
    assert set(TRAJECTORIES) == set(get_args(Trajectory)) == set(PLANNERS)
    for name in TRAJECTORIES:
        assert Strategy(name).trajectory == name
    with pytest.raises(ProcessError, match=r"trajectory 'zigzag'.*raster"):
        Strategy("zigzag")


@pytest.mark.parametrize(
    "field, value",
    [
        ("run_off_m", -0.1),
        ("offset_m", np.nan),
        ("join_gap_m", np.inf),
        ("stepover_m", 0.0),
        ("feed_m_s", np.nan),
        ("passes", 0),
        ("edge_margin_m", -0.1),
    ],
)
def test_a_value_that_cannot_be_is_named(field, value):
    with pytest.raises(ProcessError, match=f"{field} is {value}; give"):
        Strategy(**{field: value})


def test_a_direction_is_three_numbers_that_are_not_all_zero():
    assert Strategy(direction=(0.0, 0.0, 2.0)).direction == (0.0, 0.0, 2.0)
    for wrong in ((0.0, 0.0, 0.0), (1.0, 0.0), (np.inf, 0.0, 0.0)):
        with pytest.raises(ProcessError, match=r"direction is .*give 3 numbers"):
            Strategy(direction=wrong)


def test_only_a_zigzag_joins_its_lines_unless_a_gap_is_given():
    assert Strategy(stepover_m=0.03).joined_gap_m == pytest.approx(0.09)
    assert Strategy(line_order="snake").joined_gap_m == 0.0
    assert Strategy(line_order="snake", join_gap_m=0.01).joined_gap_m == 0.01
    assert Strategy(tool_radius_m=0.02).least_line_m == 0.02
    assert Strategy(minimum_length_m=0.0).least_line_m == 0.0


def test_every_name_that_is_not_known_is_told_with_those_that_are():
    for field in ("start", "line_order", "heading", "direction_mode"):
        with pytest.raises(ProcessError, match=field.replace("_", " ")):
            Strategy(**{field: "sideways"})


def test_an_origin_is_three_numbers():
    assert Strategy(origin_m=(0.0, 0.0, 0.0)).origin_m == (0.0, 0.0, 0.0)
    for wrong in ((0.0, 1.0), (np.nan, 0.0, 0.0), (0.0, 1e9, 0.0)):
        with pytest.raises(ProcessError, match=r"origin_m is .*give 3 numbers, in metres"):
            Strategy(origin_m=wrong)
