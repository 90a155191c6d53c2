"""Tables of paths on meshes, and their files."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import pytest

from builders.mesh_targets import PLATE, plate_target, rows_on_top
from nrdf_benchmark.mesh_paths.evaluate import MeshPathResult
from nrdf_benchmark.mesh_paths.measure import measure_mesh_path
from nrdf_benchmark.mesh_paths.table import (
    FIGURES,
    comparison,
    mesh_rows,
    selections,
    totals,
    write_comparison,
    write_results,
)


@pytest.fixture
def results():
    near = measure_mesh_path(plate_target(), "top", rows_on_top([0.0, 0.025]), PLATE)
    far = measure_mesh_path(plate_target(), "top", rows_on_top([0.0, 0.025], height=1e-3), PLATE)
    return [
        MeshPathResult("points", "block", "top", 0.5, near),
        MeshPathResult("points", "block", "raised", 0.5, far),
        MeshPathResult("points", "block", "rim", 0.5, None, "too narrow"),
    ]


def test_rows_tell_how_many_regions_meet_a_bar(results):
    rows = {row.name: row.cells for row in mesh_rows(results)}
    missing = {figure.name for figure in FIGURES} - set(rows)
    assert missing == {  # no rod, no spiral, and the regions were given
        "strokes of a leg or rail",
        "strokes of a spiral",
        "border for the true one's",
        "IoU with the true region, %",
    }
    assert rows["strokes of a plate or back"] == ("1", "0%", "2", "2")
    assert rows["contacts, worst, mm"] == ("<= 0.5", "50%", "0.5", "1")
    assert rows["largest step, spacings"][1] == "100%"
    assert rows["coverage, %"][1] == "0%"
    assert rows["strokes of a region"] == ("", "", "2", "2")
    assert [len(chosen) for _, chosen in selections(results)] == [3, 2, 2, 0]
    assert totals(results).startswith("2 of 3 regions planned: 4 strokes, 1.6 m on the surface")
    assert "4.0 s of CPU time for 8 regions" in totals(results)


def test_files_hold_every_region(results, tmp_path):
    text, table, content = write_results(tmp_path, "rows", results, "Paths", {"command": "nrdf"})
    assert "| coverage, % | >= 99 | 0% |" in text.read_text()
    assert "- block, rim: no path: too narrow" in text.read_text()
    assert [path.name for path in (text, table, content)] == ["rows.md", "rows.csv", "rows.json"]
    lines = list(csv.DictReader(table.read_text().splitlines()))
    assert [line["region"] for line in lines] == ["top", "raised", "rim"]
    assert float(lines[1]["distance_worst_m"]) == pytest.approx(1e-3)
    assert lines[2]["strokes"] == "" and lines[2]["error"] == "too narrow"
    read = json.loads(content.read_text())
    assert read["origin"] == {"command": "nrdf"} and len(read["results"]) == 3


def test_planners_stand_side_by_side_on_regions_that_both_planned(results, tmp_path):
    top, raised, rim = results
    both = {"raster": [top, raised], "rival": [replace(top, planner="rival"), rim]}
    (flat, rows), (curved, none) = comparison(both)
    assert (flat, curved, none) == ("flat regions, 1", "curved regions, 0", [])
    assert ("largest step, spacings", "<= 2", "100%; 1; 1", "100%; 1; 1") in rows
    text = write_comparison(tmp_path, both).read_text()
    assert (
        "| | bar | raster | rival |" in text and "| strokes of a region |  | 2; 2 | 2; 2 |" in text
    )
