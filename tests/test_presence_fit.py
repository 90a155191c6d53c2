"""How absence is fitted: what is told apart, what cannot be, and what was measured already."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.benchmark import presence
from nrdf.benchmark.scans import RegionFigure
from nrdf.errors import DataError
from nrdf.regions.presence import ABSENT


def region(pair: int, state: str, evidence: tuple[float, float], kind: str = "3 views"):
    return RegionFigure(kind, pair, "arm", state, "", 0, 0.1, evidence)


def regions(count: int = 60) -> list[RegionFigure]:
    """Absent ones with existence about -4, the others about 2; distance says nothing."""
    rng = np.random.default_rng(0)
    found = []
    for number in range(count):
        state = ("absent", "there", "there", "hidden")[number % 4]
        middle = -4 if state == "absent" else 2
        found.append(region(number // 4, state, (middle + rng.normal(), rng.normal())))
    return found


def test_what_separates_gets_the_weight():
    rule = presence.fit(regions())
    assert rule.weights[0] < -0.5 and abs(rule.weights[1]) < 0.5 * abs(rule.weights[0])
    evidence = np.array([(-5.0, 0.0), (3.0, 0.0)])
    assert rule.absent(evidence).tolist() == [True, False]


def test_canonical_clouds_do_not_count():
    misleading = [region(0, "absent", (9.0, 0.0), "canonical") for _ in range(200)]
    assert presence.fit(regions() + misleading).weights == presence.fit(regions()).weights


def test_rules_are_judged_on_pairs_that_they_were_not_fitted_on():
    figures = regions()
    figures[0] = replace(figures[0], reason=ABSENT)
    rows = {row[:2]: row[2:] for row in presence.cross_validate(figures)}
    assert rows["3 views", "absent"] == (1, 15, 15)
    assert rows["3 views", "there"] == (0, 0, 30)
    assert rows["full", "absent"] == (0, 0, 0)


def test_without_absent_regions_there_is_nothing_to_fit():
    with pytest.raises(DataError, match="0 absent regions among 2: both kinds are needed"):
        presence.fit([region(0, "there", (2.0, 0.0)), region(1, "there", (1.0, 0.0))])


def test_pairs_that_were_measured_are_kept(tmp_path, monkeypatch):
    asked = []

    def score(judge, category, pair, first_seed):
        asked.append((judge, category, pair, first_seed))
        return [region(pair, "absent", (1.0, float("nan")))]

    monkeypatch.setattr(presence, "score_regions", score)
    monkeypatch.setattr(presence, "choose_pairs", lambda category, count: list(range(count)))
    shown = []
    first = presence.collect(lambda: "judge", "chair", 2, tmp_path, lambda *n: shown.append(n))
    again = presence.collect(lambda: None, "chair", 3, tmp_path, lambda *n: None)
    assert shown == [(1, 2), (2, 2)] and len(first) == 2 and len(again) == 3
    assert [row[1:] for row in asked] == [("chair", i, presence.FIRST_SEED) for i in range(3)]
    assert again[2].evidence[0] == 1.0 and again[2].state == "absent"
    whole = (tmp_path / "chair-001.json").read_text()
    for damaged in ("[{", "[" * 100_000, '"x"', whole.replace('"pair": 1', '"pair": "x"'), "\0"):
        (tmp_path / "chair-001.json").write_text(damaged)
        with pytest.raises(DataError, match=r"chair-001\.json is damaged .* delete it"):
            presence.collect(lambda: None, "chair", 3, tmp_path, lambda *n: None)


def test_pairs_whose_target_lacks_regions_come_first():
    assert presence.choose_pairs("car", 2) == [0, 1], "no car lacks anything"
    chosen = presence.choose_pairs("chair", 2)
    assert chosen == sorted(chosen) and set(chosen) <= set(range(10)) and chosen != [0, 1]
