"""Warnings about a tool path, from its metrics."""

from __future__ import annotations

from dataclasses import replace

import pytest

from builders.taught_box import METRICS, SAND
from nrdf.process.path_warnings import path_warnings
from nrdf.process.process import Process


def warnings_of(metrics, **changes):
    return path_warnings(Process.model_validate({**SAND, **changes}), metrics)


def test_a_good_path_has_no_warnings():
    assert warnings_of(METRICS) == []


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"unreached": 0.1},
            "the tool does not reach 10.0% of the region, beside what is left out",
        ),
        (
            {"left_out": {"no_clearance": 0.194, "edge_margin": 0.1}},
            "19.4% of the region has less than 6.25 mm free before it, and is left out",
        ),
        ({"step_worst_m": 0.287}, "a step of 287 mm between neighbouring waypoints; 20 mm were"),
        ({"turn_worst_rad": 1.6}, "the tool's axis turns by 91.67° between neighbouring waypoints"),
        ({"line_spacing_worst_m": 0.05}, "lines are up to 50 mm apart; 40 mm were asked for"),
        ({"true_distance_99_m": 0.003}, "more than 3 mm off the mesh as given (12 triangles)"),
        (
            {"surface_distance_99_m": 0.003, "true_distance_99_m": None},
            "more than 3 mm off the surface planned on",
        ),
        ({"axis_error_99_rad": 0.2}, "a tool axis more than 11.46° off"),
    ],
)
def test_what_a_person_should_look_at_is_said(change, message):
    (line,) = warnings_of(replace(METRICS, **change))
    assert message in line


def test_a_cloud_cannot_tell_less_than_half_the_distance_between_its_points():
    coarse = replace(METRICS, true_distance_99_m=0.003, resolution_m=0.006)
    assert warnings_of(coarse) == []
    fine = replace(coarse, resolution_m=0.002)
    assert len(warnings_of(fine)) == 1


def test_what_the_plan_says_of_itself_is_no_warning_where_the_object_is_known():
    fine = replace(METRICS, surface_distance_99_m=0.003)
    assert warnings_of(fine) == []


def test_taught_waypoints_need_not_keep_a_stepover():
    taught = {"trajectory": "taught", "waypoints": [{"positions_m": [[0, 0, 0]]}]}
    apart = replace(METRICS, line_spacing_worst_m=0.05, step_worst_m=0.287, axis_error_99_rad=0.2)
    assert len(warnings_of(apart)) == 3 and warnings_of(apart, **taught) == []


def test_a_body_that_touches_is_told_with_its_first_place():
    touching = replace(METRICS, body_touches=0.12, body_touches_at_m=(0.1, 0.25, -0.03))
    (line,) = warnings_of(touching)
    assert line == (
        "the tool's body would touch the object at 12.0% of the places along the lines, first at "
        "(100, 250, -30) mm"
    )
    assert warnings_of(replace(METRICS, body_touches=0.0)) == []
