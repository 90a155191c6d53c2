"""`nrdf eval arm` as a user runs it."""

from __future__ import annotations

import json
from importlib.util import find_spec

import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from nrdf import cli
from nrdf_benchmark import arm as benchmark
from nrdf_benchmark.arm import ArmMetric


def test_every_chair_has_a_column_and_what_misses_its_bar_a_mark(tmp_path, monkeypatch, capsys):
    reports = {"rocker": {"chair": 1}, "armchair": {"chair": 2}}
    reach = ArmMetric(
        "waypoints reached, %", "at least 95", (99.0, 90.5, 94.8), (True, False, False)
    )
    asked = []
    monkeypatch.setattr(
        benchmark, "simulate_demo", lambda folder, _: asked.append(folder) or reports
    )
    monkeypatch.setattr(benchmark, "combine_reports", lambda _: {})
    monkeypatch.setattr(benchmark, "measure", lambda columns: [reach] * (len(columns) == 3))
    out = tmp_path / "arm.json"
    assert cli.run(["eval", "arm", str(tmp_path / "demo"), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert asked == [tmp_path / "demo"] and "rocker" in shown and "armchair" in shown
    assert "99.00 " in shown and "90.50 ✗" in shown and "94.80 ✗" in shown
    assert json.loads(out.read_text())["reports"] == reports
