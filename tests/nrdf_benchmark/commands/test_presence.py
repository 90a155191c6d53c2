"""`nrdf eval presence` as a user runs it."""

from __future__ import annotations

import numpy as np

from nrdf import cli
from nrdf_benchmark import presence
from nrdf_benchmark.presence import Example


def test_what_was_measured_is_fitted_shown_and_used_again(tmp_path, untrained, monkeypatch, capsys):
    measured = []

    def examples(scorer, pair):
        measured.append(pair)
        rng = np.random.default_rng(pair)
        found = []
        for region in range(20):
            trust = rng.uniform(-4, 4)
            overlap = 0.0 if trust < 0 else float(1 / (1 + np.exp(-trust)))
            evidence = (rng.normal(), trust, -rng.random(), rng.normal())
            names = f"chair {2 * pair}", f"chair {2 * pair + 1}", str(region)
            found.append(Example("family chair", "full", *names, overlap, trust < 0, evidence))
        return found

    monkeypatch.setattr(presence, "choose_pairs", lambda category, count: [3, 7][:count])
    monkeypatch.setattr(presence, "examples_of_members", examples)
    words = [
        "eval",
        "presence",
        "--category",
        "chair",
        "--pairs",
        "2",
        "--out",
        str(tmp_path / "p"),
    ]
    assert cli.run(words) == 0
    shown = capsys.readouterr().out
    assert measured == [3, 7] and "bias " in shown and "correlation of expected" in shown
    assert shown.count("family chair") == 2  # those that are there, and those that are absent
    assert cli.run(words) == 0
    assert measured == [3, 7] and capsys.readouterr().out == shown
