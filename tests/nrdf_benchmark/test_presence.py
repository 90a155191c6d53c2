"""How the overlap that is to be expected is fitted, and measured on what it was not fitted to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.errors import DataError
from nrdf_benchmark import presence
from nrdf_benchmark.presence import Example


def examples(count: int = 120) -> list[Example]:
    """Overlap goes with the second evidence alone; where that is low, the part is absent."""
    rng = np.random.default_rng(0)
    found = []
    for number in range(count):
        trust = rng.uniform(-4, 4)
        overlap = 0.0 if trust < -1 else float(1 / (1 + np.exp(-trust)))
        evidence = (rng.normal(), trust, -rng.random(), rng.normal())
        names = f"chair/a_{number % 7}", f"stool/b{number % 11}"
        found.append(Example("objects", "whole", *names, "arm", overlap, trust < -1, evidence))
    return found


def test_what_tells_gets_the_weight():
    rule = presence.fit(examples())
    others = np.abs(np.delete(rule.weights, 1))
    assert rule.weights[1] > 0.5 and others.max() < 0.3 * rule.weights[1]
    low, high = rule.overlap(np.array([(0, -4, -0.5, 0), (0, 4, -0.5, 0)]))
    assert low < 0.1 and high > 0.8


def test_every_source_counts_alike():
    many = [replace(e, source="family chair") for e in examples(40)]
    once, often = presence.fit(examples() + many), presence.fit(examples() + 9 * many)
    assert np.allclose(once.weights, often.weights, atol=1e-3)


def test_a_product_and_its_series_are_not_fitted_on_where_it_is_judged(monkeypatch):
    every, asked = examples(60), []
    honest = presence.fit

    def fit(chosen):
        asked.append({presence._series(n) for e in chosen for n in (e.reference, e.target)})
        return honest(chosen)

    monkeypatch.setattr(presence, "fit", fit)
    overlap = presence.cross_validate(every)
    assert presence._series("chair/mammut_1") == presence._series("stool/mammut_2") == "mammut"
    assert len(asked) == 11 and all(len(names) == 11 for names in asked)
    rows = {row[2]: row for row in presence.summary(every, overlap)}
    assert rows["absent"][5] == rows["absent"][3] and rows["there"][4] == 0
    assert rows["there"][6] == pytest.approx(rows["there"][7], abs=0.15)


def test_without_absent_parts_there_is_nothing_to_fit():
    there = [e for e in examples() if not e.absent]
    with pytest.raises(DataError, match=f"0 absent regions among {len(there)}: both kinds"):
        presence.fit(there)


def test_what_was_measured_is_not_measured_again(tmp_path):
    asked = []

    def collect():
        asked.append(1)
        return examples(3)

    folder = tmp_path / "new"
    assert presence.load_or_collect(folder, "pair", collect) == examples(3)
    assert presence.load_or_collect(folder, "pair", collect) == examples(3) and asked == [1]
    whole = (folder / "pair.json").read_text()
    for damaged in ("[{", "[" * 100_000, '"x"', whole.replace('"absent": ', '"absent": 7'), "\0"):
        (folder / "pair.json").write_text(damaged)
        with pytest.raises(DataError, match=r"pair\.json is damaged .* delete it"):
            presence.load_or_collect(folder, "pair", collect)


def test_pairs_whose_target_lacks_regions_come_first():
    assert presence.choose_pairs("car", 2) == [0, 1], "no car lacks anything"
    chosen = presence.choose_pairs("chair", 2)
    assert chosen == sorted(chosen) and set(chosen) <= set(range(10)) and chosen != [0, 1]
