from __future__ import annotations

import json
from dataclasses import replace

import pytest

from builders.taught_box import METRICS, made_up
from nrdf.process.limits import Limits
from nrdf.reports.transfer_report import (
    METRIC_COLUMNS,
    SHORT_METRIC_COLUMNS,
    metric_cells,
    report_of,
    short_metric_cells,
)


def test_a_report_says_what_was_found_asked_and_measured():
    report = report_of(made_up(), Limits(min_coverage=0.9))
    assert json.loads(json.dumps(report)) == report
    assert report["regions"]["top"]["found"] and report["regions"]["top"]["confidence"] == 0.8
    (path,) = report["paths"]
    assert (path["region"], path["process"], path["transfer"]) == ("top", "sand", "replan")
    assert path["requested"]["stepover_m"] == 0.04 and path["requested"]["force_n"] == 10
    assert path["metrics"] == vars(METRICS)
    assert (path["lines"], path["waypoints"]) == (1, 5)
    assert report["total"] == {
        "paths": 1, "skipped": 0, "path_length_m": 5.0, "process_length_m": 4.0,
        "cycle_time_s": 50.0,
    }  # fmt: skip
    assert report["warnings"] == []
    assert report["limits"] == {"set": {"min_coverage": 0.9}, "not_met": []}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"unreached": 0.1},
            "the tool does not reach 10.0% of the region, beside what is left out",
        ),
        (
            {"left_out": {"no_clearance": 0.194, "edge_margin": 0.1}},
            "19.4% of the region has less than 0 mm free before it, and is left out",
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
    report = report_of(made_up(metrics=replace(METRICS, **change)), Limits())
    (line,) = report["warnings"]
    assert line.startswith("region 'top', sand: ") and message in line


def test_a_cloud_cannot_tell_less_than_half_the_distance_between_its_points():
    coarse = replace(METRICS, true_distance_99_m=0.003, resolution_m=0.006)
    assert report_of(made_up(metrics=coarse), Limits())["warnings"] == []
    fine = replace(coarse, resolution_m=0.002)
    assert len(report_of(made_up(metrics=fine), Limits())["warnings"]) == 1


def test_what_the_plan_says_of_itself_is_no_warning_where_the_object_is_known():
    fine = replace(METRICS, surface_distance_99_m=0.003)
    assert report_of(made_up(metrics=fine), Limits())["warnings"] == []


def test_a_doubtful_region_is_said():
    (line,) = report_of(made_up(confidence=0.4), Limits())["warnings"]
    assert line == "region 'top': doubtful: confidence 0.40; look at it"


def test_what_is_skipped_has_its_reason():
    report = report_of(made_up(missing="found nowhere on the target"), Limits())
    assert not report["regions"]["top"]["found"]
    assert report["regions"]["top"]["reason"] == "found nowhere on the target"
    assert not report["paths"][0]["planned"] and "metrics" not in report["paths"][0]
    assert report["total"]["skipped"] == 1
    report = report_of(made_up(reason="edge_margin_m is 0.1, which ..."), Limits())
    assert report["warnings"] == [
        "region 'top', sand: no tool path: edge_margin_m is 0.1, which ..."
    ]


def test_figures_are_shown_as_people_read_them():
    assert dict(zip(METRIC_COLUMNS, metric_cells(vars(METRICS)), strict=True)) == {
        "worked · left out · unreached": "99.5 · 0.0 · 0.5 %",
        "overlap": "40%",
        "line spacing, mean · worst": "40.0 · 42.0 mm",
        "largest step · turn · turn by mm": "21.0 mm · 1° · 0.1°/mm",
        "off the object, 95 % · worst": "0.6 · 1.2 mm",
        "off the planned surface, 99 % · worst": "0.4 · 0.9 mm",
        "axis off, 99 %": "0.6°",
        "length": "4.00 m",
        "time": "50 s",
    }
    alone = vars(replace(METRICS, line_spacing_worst_m=None))
    assert short_metric_cells(alone)[SHORT_METRIC_COLUMNS.index("lines, mm")] == "–"
    assert metric_cells(alone)[2] == "–"
    assert dict(zip(SHORT_METRIC_COLUMNS, short_metric_cells(vars(METRICS)), strict=True)) == {
        "worked, %": "99.5", "left out, %": "0.0", "missed, %": "0.5", "lines, mm": "42.0",
        "step, mm": "21.0", "turn, °": "1", "off, mm": "0.6", "time, s": "50",
    }  # fmt: skip
