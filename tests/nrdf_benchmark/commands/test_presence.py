"""`nrdf eval presence` as a user runs it."""

from __future__ import annotations

import numpy as np

from nrdf import cli
from nrdf_benchmark import presence
from nrdf_benchmark.presence import Example


def test_what_was_measured_is_fitted_shown_and_used_again(tmp_path, untrained, monkeypatch, capsys):
    measured = []

    def examples(scorer, category, pair):
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
    assert shown.count("family chair") == 4  # there and absent, by each of two rules
    assert "by the rule in use" in shown
    assert cli.run(words) == 0
    assert measured == [3, 7] and capsys.readouterr().out == shown


def test_another_model_seeks_the_parts_for_a_rule_of_its_own(tmp_path, monkeypatch, capsys):
    seekers = []

    def examples(retrieval, reference, target, views, seeker):
        seekers.append(seeker.preset)
        return [
            Example(
                "objects", "whole", reference, target, part, 0.9 * there, not there, (3, 3, 0, 3)
            )
            for part, there in (("leg", True), ("back", False))
        ]

    pairs = [(f"table/{n}", f"table/{m}", (0,)) for n in "abcdefgh" for m in "abcdefgh" if n != m]
    monkeypatch.setattr(presence, "examples_of_objects", examples)
    monkeypatch.setattr(
        "nrdf_benchmark.commands.presence._open_objects", lambda *asked: (None, pairs)
    )
    words = f"eval presence --objects {tmp_path} --seek registration --out {tmp_path / 'p'}"
    assert cli.run(words.split()) == 0
    assert seekers == ["registration"] * 19  # every third pair; no family beside them
    assert "family" not in capsys.readouterr().out

    members = []

    def of_members(scorer, category, pair):
        members.append((scorer.model.preset, scorer.prototypes, category, pair))
        return [
            Example("family car", "full", f"car {pair}", "car 1", "1", 0.5, False, (3, 3, 0, 3))
        ]

    monkeypatch.setattr(presence, "choose_pairs", lambda category, count: [3, 7][:count])
    monkeypatch.setattr(presence, "examples_of_members", of_members)
    assert cli.run([*words.split(), "--category", "car"]) == 0
    assert members == [("registration", 8, "car", 3), ("registration", 8, "car", 7)]
    assert len(seekers) == 19 and "family car" in capsys.readouterr().out
