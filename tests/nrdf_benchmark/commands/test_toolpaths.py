"""`nrdf eval toolpaths` as a user runs it."""

from __future__ import annotations

import numpy as np

from builders.mesh_targets import rows_on_top
from builders.surfaces import board
from nrdf import cli
from nrdf_benchmark.toolpaths import (
    PlanningObject,
)


def flat(name: str = "board", exact=None) -> PlanningObject:
    points, normals = board()
    return PlanningObject(name, points, normals, {"all": np.arange(len(points))}, exact)


def test_the_command_shows_both_tables(monkeypatch, capsys):
    monkeypatch.setattr("nrdf_benchmark.toolpaths.family_members", lambda *_: [flat()])
    assert cli.run(["eval", "toolpaths", "--category", "table", "--members", "1"]) == 0
    shown = capsys.readouterr().out
    assert "table, families, raster: all regions, 1" in shown
    assert "those that the footprint fits into, 1" in shown
    assert shown.count("worst line spacing, stepovers") == 2
    assert "s of CPU time for 8 regions" in shown


def test_meshes_are_measured_beside_the_bars(monkeypatch, capsys, tmp_path):
    import trimesh

    trimesh.creation.box((1.0, 0.4, 0.1)).export(tmp_path / "plate.ply")
    monkeypatch.setattr(
        "nrdf_benchmark.mesh_paths.evaluate._on_mesh",
        lambda target, planner, strategy, surface: lambda region: (rows_on_top([0.0, 0.025]), None),
    )
    out = tmp_path / "out"
    given = ["eval", "toolpaths", "--meshes", str(tmp_path / "plate.ply"), "--out", str(out)]
    assert cli.run(given) == 0
    shown = capsys.readouterr().out
    assert "planner auto: all regions, 1" in shown.replace("\n", " ").replace("  ", " ")
    assert "contacts from given mesh, 99 %, mm" in shown and "<= 0.1" in shown
    assert sorted(path.suffix for path in out.glob("auto-mesh.*")) == [".csv", ".json", ".md"]


def test_two_planners_are_shown_side_by_side(capsys, tmp_path):
    import trimesh

    trimesh.creation.box((1.0, 0.4, 0.1)).export(tmp_path / "plate.ply")
    given = [
        "eval",
        "toolpaths",
        "--meshes",
        str(tmp_path / "plate.ply"),
        "--out",
        str(tmp_path / "o"),
    ]
    assert cli.run([*given, "--planner", "raster", "plane-slices"]) == 0
    shown = capsys.readouterr().out
    assert "flat regions, 1: met by; median; worst" in shown.replace("\n", " ").replace("  ", " ")
    assert (tmp_path / "o" / "comparison.md").is_file()
    assert (tmp_path / "o" / "pictures" / "raster-mesh").is_dir()


def test_what_to_plan_on_has_to_be_given(capsys):
    assert cli.run(["eval", "toolpaths"]) != 0
    assert "--meshes" in capsys.readouterr().err
