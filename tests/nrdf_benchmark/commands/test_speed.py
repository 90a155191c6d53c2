"""`nrdf eval speed`: tables and files of what was measured."""

from __future__ import annotations

import json

from nrdf.errors import NrdfError
from nrdf_benchmark.commands.speed import speed
from nrdf_benchmark.speed import measure as module


def test_measure_reports_what_fails_and_goes_on(monkeypatch, tmp_path, untrained, capsys):
    def alone(function, preset, *arguments):
        if preset == "paper":
            raise NrdfError("no such thing here")
        return function(preset, *arguments)

    monkeypatch.setattr(module, "in_new_process", alone)
    monkeypatch.setattr(module, "command_seconds", lambda *arguments: 4.5)
    monkeypatch.setattr(module, "choose_weights", lambda *arguments: (untrained, "untrained"))
    monkeypatch.setattr(module, "measure_training", lambda *arguments: [])
    monkeypatch.setattr("nrdf_benchmark.speed.large.KINDS", {})  # minutes: test_large.py
    speed(repeats=1, steps=1, out=tmp_path / "speed.json")
    said = json.loads((tmp_path / "speed.json").read_text())
    assert [s["preset"] for s in said["retrieval"]] == ["default"]
    assert said["retrieval"][0]["command_s"] == 4.5
    assert {(f["preset"], f["what"]) for f in said["failures"]} == {
        ("paper", "retrieval"),
        ("paper", "training"),
    }
    shown = capsys.readouterr().out
    assert "no such thing here" in shown and "4.500" in shown
