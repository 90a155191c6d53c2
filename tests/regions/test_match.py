"""A match: its score, its presence, and its indices in the scan that it was found in."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from nrdf.regions.match import FOUND, Match
from nrdf.regions.presence import ABSENT, Presence


@pytest.fixture
def match() -> Match:
    return Match(np.array([0, 2, 3]), np.zeros((4, 3)), np.array([0.9, 0.6, 0.3]), "mask")


def test_the_score_is_the_mean_confidence(match):
    assert match.score == pytest.approx(0.6) and match.presence is FOUND
    none = Match(match.indices[:0], match.points, match.confidence[:0], "mask")
    assert none.score == 0.0


def test_confidence_is_scaled_to_the_expected_overlap(match):
    found = match.with_presence(Presence("", 0.4, 0.4, 1.0))
    assert found.score == pytest.approx(0.4)
    sure = match.with_presence(Presence("", 0.9, 0.9, 1.0))
    assert sure.confidence.max() == 1.0, "no point is more than certain"


def test_an_absent_region_comes_back_empty_unless_asked_for(match):
    absent = Presence(ABSENT, 0.99, 0.01, 1.0)
    empty = match.with_presence(absent)
    assert len(empty.indices) == len(empty.confidence) == 0 and empty.presence is absent
    kept = match.with_presence(absent, drop_absent=False)
    assert kept.indices.tolist() == [0, 2, 3] and kept.score == pytest.approx(0.01)


def test_indices_are_brought_to_those_of_the_scan(match):
    aligned = SimpleNamespace(cleaned=SimpleNamespace(kept=np.array([5, 6, 8, 9])))
    assert match.in_scan(aligned).indices.tolist() == [5, 8, 9]
