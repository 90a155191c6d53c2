"""A transfer's report: plain values, and their cells in tables."""

from __future__ import annotations

import json
from dataclasses import replace

from builders.taught_box import METRICS, made_up
from nrdf.process.limits import Limits
from nrdf.reports.transfer_report import (
    METRIC_COLUMNS,
    SHORT_METRIC_COLUMNS,
    metric_cells,
    short_metric_cells,
    transfer_report,
)


def test_a_report_says_what_was_found_asked_and_measured():
    report = transfer_report(made_up(), Limits(min_coverage=0.9))
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


def test_a_warning_says_its_region_and_process():
    report = transfer_report(made_up(metrics=replace(METRICS, unreached=0.1)), Limits())
    (line,) = report["warnings"]
    assert line.startswith("region 'top', sand: the tool does not reach 10.0% of the region")
    assert report["paths"][0]["warnings"] == [line.removeprefix("region 'top', sand: ")]


def test_a_doubtful_region_is_said():
    (line,) = transfer_report(made_up(confidence=0.4), Limits())["warnings"]
    assert line == "region 'top': doubtful: confidence 0.40; look at it"


def test_what_is_skipped_has_its_reason():
    report = transfer_report(made_up(missing="found nowhere on the target"), Limits())
    assert not report["regions"]["top"]["found"]
    assert report["regions"]["top"]["reason"] == "found nowhere on the target"
    assert not report["paths"][0]["planned"] and "metrics" not in report["paths"][0]
    assert report["total"]["skipped"] == 1
    report = transfer_report(made_up(reason="edge_margin_m is 0.1, which ..."), Limits())
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
        "off the mesh planned on, 99 % · worst": "0.4 · 0.9 mm",
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
