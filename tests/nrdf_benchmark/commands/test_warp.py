"""`nrdf eval warp` as a user runs it."""

from __future__ import annotations

import numpy as np

from nrdf import cli
from nrdf_benchmark import warp
from nrdf_benchmark.warp import WarpResult


def test_the_verb_prints_the_figures(untrained, monkeypatch, capsys):
    errors = (np.array([0.01, 0.02, 0.03]), np.array([0.05]))
    result = WarpResult("chair", errors, 0.02, 0.5, np.array([0.9, 0.1]), np.array([True, False]))
    monkeypatch.setattr(warp, "evaluate_warp", lambda *asked: result)
    assert cli.run(["eval", "warp", "--category", "chair", "--model", str(untrained)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "2.50%" in said and "5.00%" in said and "4 waypoints" in said
    assert "of 1 regions that targets have, 100.0% are found" in said
    assert "of 1 that they lack, 0%" in said
