"""`nrdf eval toolpaths` as a user runs it."""

from __future__ import annotations

import numpy as np

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
