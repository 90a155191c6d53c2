"""Regions that are absent, were not observed, or are there."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.regions.presence import ABSENT, NOT_OBSERVED, find_presence


def ask(exists=0.95, error=0.05, usual=0.05, distance=0.03, count=40):
    return find_presence(
        np.full(count, exists), np.full(count, error), usual, np.full(count, distance)
    )


def test_what_the_field_is_sure_of_is_there():
    found = ask()
    assert found.reason == "" and found.confidence > 0.9 and found.observed == 1


def test_what_the_field_doubts_is_absent():
    for distance in (0.1, 0.3):
        found = ask(exists=0.1, error=0.12, distance=distance)
        assert found.reason == ABSENT and found.confidence > 0.9


def test_where_no_points_are_it_was_not_observed():
    found = ask(distance=0.2)
    assert found.reason == NOT_OBSERVED and found.observed == 0 and 0.5 < found.confidence <= 1
    some = np.where(np.arange(40) < 10, 0.02, 0.5)
    part = find_presence(np.full(40, 0.95), np.full(40, 0.05), 0.05, some)
    assert part.reason == "" and part.observed == 0.25


@pytest.mark.parametrize(
    ("worse", "values"),
    [("exists", (0.9, 0.5, 0.1)), ("error", (0.03, 0.06, 0.15)), ("distance", (0.01, 0.03, 0.07))],
)
def test_each_kind_of_evidence_counts(worse, values):
    def absent(value):
        found = ask(**{worse: value})
        return found.confidence if found.reason == ABSENT else 1 - found.confidence

    chances = [absent(value) for value in values]
    assert chances == sorted(chances) and chances[0] < chances[-1]


def test_a_field_that_expects_no_error_is_asked_for_existence_alone():
    sure, unsure = (ask(exists=e, error=0.0, usual=0.0, distance=0.05) for e in (0.99, 0.01))
    assert sure.reason == "" and unsure.reason == ABSENT
