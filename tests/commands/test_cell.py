"""`nrdf cell` and `nrdf export --cell`."""

from __future__ import annotations

import json

import pytest

from builders.cells import cell_of
from builders.export_jobs import small_job
from nrdf import cli
from nrdf.bundled import KNOWLEDGE
from nrdf.cell.file import read_cell, write_cell
from nrdf.toolpath.file import write_toolpaths


def said(capsys):
    return " ".join("".join(capsys.readouterr()).split())


def test_a_cell_is_begun_checked_and_never_overwritten(tmp_path, capsys):
    file = str(tmp_path / "cell.yaml")
    words = ["--knowledge", str(KNOWLEDGE), "--format", "krl", "gcode", "--out", file]
    assert cli.run(["cell", "new", *words]) == 0
    assert cli.run(["cell", "check", file, "--without-robot"]) == 0
    text = said(capsys)
    assert "nothing is wrong" in text and "every chair" in text
    assert "'sanding disc' has a spindle, which no krl program switches" in text
    assert cli.run(["cell", "new", "--out", file]) == 2
    assert cli.run(["cell", "new", "--format", "krll", "--out", str(tmp_path / "b.yaml")]) == 2


def test_check_names_tools_that_are_missing_and_options_that_are_not(tmp_path, capsys):
    file = tmp_path / "cell.yaml"
    write_cell(file, cell_of(knowledge=[{"file": str(KNOWLEDGE)}]))
    assert cli.run(["cell", "check", str(file), "--without-robot"]) == 2
    assert "the cell has no tool 'sanding disc'" in said(capsys)
    write_cell(file, cell_of(programs={"formats": ["urscript"], "options": {"blend": 1}}))
    assert cli.run(["cell", "check", str(file), "--without-robot"]) == 2
    assert "programs.options: no option 'blend'" in said(capsys)


def test_check_loads_the_robot(tmp_path, capsys):
    pytest.importorskip("mujoco")
    file = tmp_path / "cell.yaml"
    write_cell(file, cell_of(robot={"tool_frame": "no-such-flange"}))
    assert cli.run(["cell", "check", str(file)]) == 2
    assert "no-such-flange" in said(capsys)


def test_export_for_a_cell_takes_its_formats_and_stays_within_its_limits(tmp_path, capsys):
    job, file = tmp_path / "job", tmp_path / "cell.yaml"
    job.mkdir()
    write_toolpaths(job, small_job())
    write_cell(file, cell_of(programs={"formats": ["urscript", "json"]}))
    assert cli.run(["export", str(job), "--cell", str(file)]) == 0
    report = json.loads((job / "export" / "report.json").read_text())
    assert set(report["formats"]) == {"urscript", "json"} and report["cell"] == str(file)
    content = json.loads((job / "export" / "json" / "nrdf_plate.json").read_text())
    assert content["frame"] == "base" and content["paths"][0]["cell_tool"]["mass_kg"] == 1.4
    assert cli.run(["export", str(job), "--cell", str(file), "--tool", "x", "--overwrite"]) == 2
    slow = read_cell(file).model_copy(update={"robot": cell_of(robot={"max_feed_m_s": 0.05}).robot})
    write_cell(file, slow)
    out = tmp_path / "slow"
    assert cli.run(["export", str(job), "--cell", str(file), "--out", str(out)]) == 3
    assert not out.exists() and "above the cell's 50.0 mm/s" in said(capsys)
    assert cli.run(["export", str(job)]) == 2
    assert "needs --format, or --cell" in said(capsys)
