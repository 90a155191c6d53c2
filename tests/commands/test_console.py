"""Tables, log lines and the words of a report."""

from __future__ import annotations

import json
import logging
import sys

from nrdf.commands.console import (
    LogHandler,
    command_line,
    progress_bar,
    provenance,
    show,
    table,
    versions,
    write_report,
)


def test_a_table_aligns_numbers_right_and_breaks_units_off(capsys):
    made = table("title", "name", "length, mm", texts=1)
    made.add_row("a", "1.0")
    made.add_row("b", "100.0")
    show(made)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert lines[:3] == ["title", "       length", "name       mm"] or lines[0] == "title"
    assert lines[-2].endswith("  1.0") and lines[-1].endswith("100.0")
    assert len(lines[-2]) == len(lines[-1])


def test_a_report_lists_all_files_and_itself(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "a.ply").write_text("")
    write_report(tmp_path, {"seed": 3})
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["files"] == ["deep/a.ply", "report.json"] and report["seed"] == 3
    assert report["date"].endswith("+00:00")


def test_what_a_report_says_of_its_origin(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["/somewhere/nrdf", "check", "my file.yaml"])
    assert command_line() == "nrdf check 'my file.yaml'"
    assert provenance({"name": "chair", "commit": "abc", "secret": 1}) == {
        "name": "chair",
        "commit": "abc",
    }
    assert {"python", "nrdf", "torch", "numpy"} <= set(versions())


def test_log_lines_go_to_standard_error_with_the_module_where_it_is_debugging(capsys):
    handler = LogHandler()
    for level in (logging.DEBUG, logging.WARNING):
        handler.emit(logging.LogRecord("nrdf.io", level, "", 0, "it is %s", ("so",), None))
    said = capsys.readouterr()
    assert said.out == "" and said.err == "nrdf.io: it is so\nit is so\n"


def test_a_progress_bar_is_silent_where_nobody_looks(capsys):
    with progress_bar("shapes") as progress:
        progress(1, 2)
    said = capsys.readouterr()
    assert said.out + said.err == ""
