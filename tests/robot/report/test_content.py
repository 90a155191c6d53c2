from __future__ import annotations

from dataclasses import replace

import pytest

from nrdf.robot.report.content import COLUMNS, metrics_row, simulation_report
from nrdf.robot.simulation.collision import Collision


def test_totals_are_those_of_the_paths(plate):
    report = simulation_report(plate)
    (path,) = report["paths"]
    assert report["total"]["waypoints"] == path["waypoints"] == 27
    assert report["total"]["force_within"] == pytest.approx(path["force"]["within"])
    assert report["placement"]["turntable_used_rad"] == [0.0]
    assert path["lines"] == 3 and path["force"]["commanded_n"] == 10.0
    assert path["coverage"]["executed"] == pytest.approx(path["coverage"]["planned"])


def test_a_row_has_a_value_for_each_column(plate):
    row = metrics_row(simulation_report(plate)["paths"][0])
    assert len(row) == len(COLUMNS) and row[0] == "100.0%"


def test_collisions_and_rejected_sections_are_warned_of(plate):
    hit = Collision("top", "process", 2, "object", 0.1, 0.003)
    path = replace(plate.paths[0], collisions=(hit,), rejected=(hit, hit))
    report = simulation_report(replace(plate, paths=(path,)))
    said = "\n".join(report["warnings"])
    assert "1 moves collide; the worst, process of line 2, the object by 3.0 mm" in said
    assert "2 moves (process) collided when they were tried, and are left out" in said
    assert report["total"]["collisions"] == 1 and report["total"]["rejected"] == 2
