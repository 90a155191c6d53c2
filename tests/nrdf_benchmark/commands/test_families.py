"""`nrdf eval families` as a user runs it."""

from __future__ import annotations

import numpy as np

from nrdf import cli
from nrdf_benchmark import families
from nrdf_benchmark.families import FamilyResult


def test_errors_stand_beside_those_of_the_copy(untrained, monkeypatch, capsys):
    field, box = np.array([0.01, 0.02, 0.06]), np.array([0.1, 0.2, 0.3])
    result = FamilyResult("chair", field, box, np.array([0.5, 0.7, 0.9]))
    asked = []
    monkeypatch.setattr(
        families, "evaluate_family", lambda model, *words: asked.append(words[:2]) or result
    )
    words = ["eval", "families", "--category", "chair", "--model", str(untrained), "--pairs", "3"]
    assert cli.run(words) == 0
    shown = capsys.readouterr().out
    assert asked == [("chair", 3)]
    assert "0.0300" in shown and "0.0200" in shown and "0.0600" in shown and "0.3000" in shown
    assert "C is 6.7 times closer" in shown and "70% of a reference's surface" in shown
