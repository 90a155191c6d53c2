"""Regions that are absent, were not observed, or are there."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.regions.presence import ABSENT, NOT_OBSERVED, find_presence


def ask(exists=0.95, distance=0.03, count=40):
    return find_presence(np.full(count, exists), np.full(count, distance))


def test_what_the_field_is_sure_of_is_there():
    found = ask()
    assert found.reason == "" and found.confidence > 0.9 and found.observed == 1


def test_what_the_field_doubts_is_absent_wherever_it_was_mapped():
    for distance in (0.01, 0.3):
        found = ask(exists=0.1, distance=distance)
        assert found.reason == ABSENT and found.confidence > 0.9


def test_where_no_points_are_it_was_not_observed():
    found = ask(exists=0.99, distance=0.2)
    assert found.reason == NOT_OBSERVED and found.observed == 0 and 0.5 < found.confidence <= 1
    some = np.where(np.arange(40) < 10, 0.02, 0.5)
    part = find_presence(np.full(40, 0.95), some)
    assert part.reason == "" and part.observed == 0.25


def test_a_few_mapped_points_on_the_surface_are_enough_to_be_there():
    near = np.where(np.arange(40) < 9, 0.02, 0.5)
    few = np.where(np.arange(40) < 7, 0.02, 0.5)
    assert find_presence(np.full(40, 0.7), near).reason == ""
    assert find_presence(np.full(40, 0.7), few).reason == ABSENT


@pytest.mark.parametrize(
    ("worse", "values"), [("exists", (0.9, 0.5, 0.1)), ("distance", (0.01, 0.03, 0.07))]
)
def test_each_kind_of_evidence_counts(worse, values):
    def absent(value):
        found = ask(**{worse: value})
        return found.confidence if found.reason == ABSENT else 1 - found.confidence

    chances = [absent(value) for value in values]
    assert chances == sorted(chances) and chances[0] < chances[-1]


def test_a_field_that_says_nothing_of_existence_finds_what_it_maps_onto_the_target():
    assert ask(exists=1.0, distance=0.07).reason == ""
