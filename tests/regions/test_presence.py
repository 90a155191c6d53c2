"""How far regions can be believed: found, doubtful, absent, or not observed."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.regions.match import Match
from nrdf.regions.presence import (
    ABSENT,
    NOT_OBSERVED,
    SURELY_ABSENT,
    Evidence,
    evidence_of,
    find_presence,
)

NEAR = np.full(40, 0.02)


def ask(distance=NEAR, exists=0.95, trust=0.8, size=0.9, returned=0.9, whole=NEAR):
    exists = np.full(len(distance), exists)
    evidence = evidence_of(exists, trust, size, returned)
    return find_presence(evidence, distance, whole)


def test_where_all_agrees_the_region_is_there():
    found = ask()
    assert found.reason == "" and found.confidence == found.overlap > 0.6 and found.observed == 1


def test_where_nothing_agrees_it_is_absent():
    found = ask(np.full(40, 0.3), exists=0.05, trust=0.05, size=0.01, returned=0.0)
    assert found.reason == ABSENT
    assert found.overlap < SURELY_ABSENT and found.confidence == 1 - found.overlap


def test_where_little_is_shown_nothing_is_surely_absent():
    doubts = {"exists": 0.05, "trust": 0.05, "size": 0.01, "returned": 0.0}
    partial = np.where(np.arange(40) < 18, 0.02, 0.5)
    some = ask(partial, **doubts, whole=partial)
    assert some.reason == "" and some.overlap < SURELY_ABSENT
    assert ask(partial, **doubts).reason == ABSENT
    assert ask(np.full(40, 0.3), **doubts, whole=partial).reason == NOT_OBSERVED


def test_one_doubt_alone_does_not_empty_a_region():
    for doubt in (
        {"exists": 0.02}, {"trust": 0.1}, {"size": 0.05}, {"returned": 0.0},
    ):  # fmt: skip
        found = ask(**doubt)
        assert found.reason == "" and 0.0 < found.overlap <= ask().overlap


def test_where_no_points_are_it_was_not_observed():
    found = ask(np.full(40, 0.2))
    assert found.reason == NOT_OBSERVED and found.observed == 0 and found.confidence == 1
    part = ask(np.where(np.arange(40) < 10, 0.02, 0.5))
    assert part.reason == "" and part.observed == 0.25


@pytest.mark.parametrize(
    ("evidence", "values"),
    [
        ("exists", (0.1, 0.5, 0.9)),
        ("trust", (0.2, 0.5, 0.9)),
        ("size", (0.1, 0.4, 1.0)),
        ("returned", (0.1, 0.5, 0.9)),
    ],
)
def test_each_kind_of_evidence_counts(evidence, values):
    overlaps = [ask(**{evidence: value}).overlap for value in values]
    assert overlaps == sorted(overlaps) and overlaps[0] < overlaps[-1]


def test_evidence_stays_finite():
    none = evidence_of(np.zeros(5), 0.0, 0.0, 0.0)
    sure = evidence_of(np.ones(5), 1.0, 7.0, 1.0)
    assert np.isfinite([none, sure]).all()
    assert none.existence == pytest.approx(-sure.existence) and none.existence < 0
    assert sure.size == 0 > none.size


def test_a_match_has_the_confidence_that_its_presence_allows():
    match = Match(np.arange(4), np.zeros((9, 3)), np.array([0.4, 0.6, 0.6, 0.8]), "mask")
    doubtful = find_presence(Evidence(0.0, -1.0, -1.0, -1.0), NEAR, NEAR)
    kept = match.with_presence(doubtful)
    assert len(kept.indices) == 4 and kept.score == pytest.approx(doubtful.overlap)
    assert np.allclose(kept.confidence / kept.score, match.confidence / match.score)
    gone = find_presence(Evidence(-3.9, -3.9, -3.9, -3.9), NEAR, NEAR)
    assert gone.reason == ABSENT and len(match.with_presence(gone).indices) == 0
    assert len(match.with_presence(gone, drop_absent=False).indices) == 4
