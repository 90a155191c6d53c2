"""A process: what it may say, and what is refused with which words."""

from __future__ import annotations

from typing import get_args

import pytest

from builders.knowledge import SAND, TAUGHT, parsed
from nrdf.errors import ProcessError
from nrdf.process.process import Process, Trajectory
from nrdf.toolpath.strategy import TRAJECTORIES


def test_trajectories_are_those_of_the_planners_and_taught_ones():
    assert set(get_args(Trajectory)) == {*TRAJECTORIES, "taught"}


def test_taught_segments_are_warped_and_strategies_planned_anew_unless_asked_otherwise():
    assert Process.model_validate(TAUGHT).transfer_mode == "warp"
    assert Process.model_validate(SAND).transfer_mode == "replan"
    assert Process.model_validate({**SAND, "transfer": "warp"}).transfer_mode == "warp"


def test_the_overlap_gives_the_stepover():
    given = {key: value for key, value in SAND.items() if key != "stepover_mm"}
    process = Process.model_validate({**given, "overlap": 0.2})
    assert process.distance_between_lines_m == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"feed_mm_s": 0}, "region 'seat', process 1 (sand), feed_m_s: must be above 0.0, not 0.0"),
        ({"feed_mm_s": -3}, "feed_m_s: must be above 0.0, not -0.003"),
        ({"feed_mm_s": True}, "feed_m_s: must be a number, not True"),
        ({"feed_m_s": 1}, "give feed_m_s or feed_mm_s, not both"),
        ({"stepover_mm": None}, "a raster needs stepover_m or overlap"),
        ({"overlap": 0.2}, "give stepover_m or overlap, not both"),
        ({"overlap": 1, "stepover_mm": None}, "overlap: must be below 1.0, not 1"),
        ({"steppover_mm": 3}, "unknown key 'region 'seat', process 1 (sand), steppover_mm'; did "
         "you mean 'stepover_mm'?"),
        ({"trajectory": "zigzag"}, "trajectory: must be 'raster', 'plane-slices', "
         "'cross-hatch', 'contour', 'spiral', 'edge', 'rod' or 'taught', not 'zigzag'"),
        ({"direction_mode": "fixed"}, "direction_mode fixed needs a direction"),
        ({"direction_mode": "principal", "direction": [1, 0, 0]}, "remove the direction, or"),
        ({"start": "inside"}, "start of a raster is near-left, near-right, far-left or far-right"),
        ({"trajectory": "spiral", "start": "far-left"}, "start of a spiral is outside or inside"),
        ({"trajectory": "rod", "start": "outside"}, "start of a rod is near-left"),
        ({"trajectory": "contour", "origin_m": [0, 0, 0]}, "a contour has no origin_m; raster, "),
        ({"origin_m": [0, 0]}, "origin_m"),
        ({"origin_mode": "fixed"}, "origin_mode fixed needs origin_m"),
        ({"origin_m": [0, 0, 0], "origin_mode": "best"}, "origin_mode: must be 'taught' or"),
        ({"resample_step_mm": 50}, "resample_step_m needs chord_error_m"),
        ({"resample_turn_deg": 0}, "resample_turn_rad: must be above 0"),
        ({"resample_turn_deg": 45}, "resample_turn_rad is 0.785398 (45°), above what is"),
        ({"line_order": "zig-zag"}, "line_order: must be 'zigzag', 'snake', 'one-way' or"),
        ({"edge_contact_mm": 5}, "edge_contact_m needs lead_rad or tilt_rad"),
        ({"run_off_height_mm": 5}, "run_off_height_m needs run_off_m"),
        ({"run_off_mm": -5}, "run_off_m: must be at least 0.0, not -0.005"),
        ({"largest_turn_deg_mm": 90}, "largest_turn_rad_m is 1570.8 (90° a mm), above what is"),
        ({"direction": [0, 0, 0]}, "direction: a direction needs a length above 0"),
        ({"lead_deg": 90}, "lead_rad: must be below 1.57"),
        ({"passes": 0}, "passes: must be at least 1, not 0"),
        ({"kind": "custom"}, "kind is custom: give a name that says what is done"),
        ({"force_n": 0}, "force_n: must be above 0.0, not 0"),
        ({"force_n": 9, "standoff_mm": 2}, "a force without contact: force_n is 9, but standoff_m "
         "is 0.002"),
        ({"kind": "paint", "force_n": 9}, "a force without contact: force_n is 9, but kind paint"),
        ({"kind": "inspect", "force_n": 9}, "a force without contact"),
        ({"force_tolerance_n": 9}, "force_tolerance_n needs force_n"),
        ({"force_n": 9, "force_tolerance_n": 9}, "it must be below force_n, 9"),
        ({"trajectory": "taught"}, "trajectory is taught: give its waypoints"),
        ({**TAUGHT, "waypoints": []}, "trajectory is taught: give its waypoints"),
        ({**TAUGHT, "transfer": "replan"}, "use transfer: warp"),
        ({"waypoints": TAUGHT["waypoints"]}, "waypoints need trajectory: taught, not raster"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0]]}]}, "line 1, positions_m"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0, 0]], "quaternions_xyzw": []}]},
         "line 1: 0 quaternions_xyzw do not fit 1 positions_m"),
        ({**TAUGHT, "waypoints": [{"positions_m": [[0, 0, 0]],
          "quaternions_xyzw": [[0, 0, 0, 2]]}]}, "a quaternion needs length 1, not 2"),
        ({"tool": {"radius_mm": 9, "body_radius_mm": 9}}, "body_radius_m needs body_length_m"),
        ({"tool": {"radius_mm": 9, "body_length_mm": 2000}}, "tool.body_length_m is 2 (2000 mm)"),
        ({"tool": {"radius_mm": 0}}, "tool.radius_m: must be above 0.0, not 0.0"),
        ({"tool": {"radius_mm": 1, "nmae": "x"}}, "tool.nmae'; did you mean 'name'?"),
        ({"tool": {"radius_mm": 1, "name": "a\nb"}}, "a name needs printable characters"),
        ({"approach": {"angle_deg": 100}}, "approach.angle_rad: must be at most 1.57"),
        ({"parameters": [1]}, "parameters: must be a mapping"),
    ],
)  # fmt: skip
def test_a_process_that_makes_no_sense_is_explained_by_field_and_value(change, message):
    given = {key: value for key, value in {**SAND, **change}.items() if value is not None}
    with pytest.raises(ProcessError) as caught:
        parsed(process=given)
    assert message in str(caught.value)


IMPLAUSIBLE = [
    ({"feed_mm_s": 120_000}, "feed_m_s is 120 (120000 mm/s), above what is plausible, 5 (5000"),
    ({"feed_mm_s": 0.01}, "feed_m_s is 1e-05 (0.01 mm/s), below what is plausible, 0.0001"),
    ({"force_n": 20_000}, "force_n is 20000 (20000 N), above what is plausible, 500 (500 N)"),
    ({"dwell_s": 1e9}, "dwell_s is 1e+09 (1000000000 s), above what is plausible, 3600 (3600 s)"),
    ({"approach": {"distance_m": 1000}}, "approach.distance_m is 1000 (1000000 mm), above"),
    ({"retract": {"feed_m_s": 9}}, "retract.feed_m_s is 9 (9000 mm/s), above"),
    ({"standoff_m": 2}, "standoff_m is 2 (2000 mm), above what is plausible, 1 (1000 mm)"),
    ({"stepover_mm": 1e-3}, "stepover_m is 1e-06 (0.001 mm), below what is plausible, 0.0001"),
    ({"stepover_mm": None, "overlap": 0.999999},
     "with overlap 0.999999, stepover_m is 5e-08 (5e-05 mm), below what is plausible"),
    ({"spacing_m": 2}, "spacing_m is 2 (2000 mm), above"),
    ({"edge_margin_m": 3}, "edge_margin_m is 3 (3000 mm), above"),
    ({"tool": {"radius_m": 1e-9}}, "tool.radius_m is 1e-09 (1e-06 mm), below"),
    ({"tool": {"radius_m": 25}}, "tool.radius_m is 25 (25000 mm), above"),
    ({"tool": {"radius_m": 0.02, "clearance_m": 20}}, "tool.clearance_m is 20 (20000 mm), above"),
    ({"tool": {"radius_m": 0.02, "tcp_m": [0, 0, -80]}}, "tool.tcp_m is -80 (-80000 mm), below"),
    ({"passes": 500}, "passes is 500 (500), above what is plausible, 100"),
    ({"lead_deg": 80}, "lead_rad is 1.39626 (80°), above what is plausible, 1.0472 (60°)"),
    ({"spindle_rpm": 1e6}, "spindle_rad_s is 104720 (1000000 rpm), above"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), IMPLAUSIBLE)
def test_what_no_process_has_is_refused_with_its_unit_unless_it_is_meant(change, message):
    given = {key: value for key, value in {**SAND, **change}.items() if value is not None}
    with pytest.raises(ProcessError, match="set allow_unusual: true in the process") as caught:
        parsed(process=given)
    assert message in str(caught.value)
    assert parsed(process={**given, "allow_unusual": True})


def test_all_that_is_implausible_is_said_at_once():
    given = {"kind": "sand", "tool": {"radius_mm": 25}, "feed_m_s": 120, "force_n": 900}
    with pytest.raises(ProcessError, match=r"force_n is 900 .*feed_m_s is 120 .*overlap") as caught:
        parsed(process={**given, "overlap": 0.9999})
    assert str(caught.value).count("allow_unusual") == 1
