"""Errors of models on objects that they have not learned from, where the truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from builders.desk_lamps import lamp, sampled
from nrdf.learn import judge
from nrdf.learn.judge import deformed_copy, difference, measure
from nrdf.regions.model import load_model


def test_the_places_on_a_deformed_copy_are_exact():
    shape = sampled(lamp(0), "a", 0)
    reference, target, places = deformed_copy(shape, 0)
    assert len(reference) == len(target) == len(places) == 4096
    again = deformed_copy(shape, 0)
    assert np.array_equal(places, again[2])
    assert not np.allclose(deformed_copy(shape, 1)[2], places)
    # The copy's own points lie between the exact places, and it has changed.
    from scipy.spatial import cKDTree

    assert cKDTree(places).query(target.points)[0].mean() < 0.01
    assert np.linalg.norm(places - reference.points, axis=1).mean() > 0.02


def test_registration_is_better_than_a_field_that_knows_nothing(untrained, monkeypatch):
    monkeypatch.setattr(judge, "COPIES", 1)
    monkeypatch.setattr(judge, "REFERENCES", 1)
    shapes = [sampled(lamp(n), f"lamp{n}", n) for n in range(3)]
    models = {"untrained": load_model(untrained), "registration": load_model("registration")}
    told = []
    errors = measure(models, shapes[:1], shapes[1:], lambda *n: told.append(n))
    assert errors.names == ("lamp0",) and errors.models == ("untrained", "registration")
    assert errors.exact[0, 1] < 0.02 < errors.exact[0, 0]
    assert errors.doubt[0, 1] < errors.doubt[0, 0]
    assert told == [(1, 1)]
    assert errors.describe()["held_out"] == ["lamp0"]


def test_a_difference_has_an_interval_over_the_objects():
    errors = np.array([[1.0, 2.0], [2.0, 3.5], [3.0, 4.0]])
    mean, half = difference(errors, 0, 1)
    assert mean == pytest.approx(-7 / 6) and 0.5 < half < 1.0
    assert difference(errors[:1], 0, 1) == (-1.0, float("inf"))
