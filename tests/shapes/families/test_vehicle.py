"""Semantic stations along bodies."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families import Family, get_family
from nrdf.shapes.families.vehicle import semantic_station

CAR, PLANE = get_family("car"), get_family("plane")


@pytest.mark.parametrize("family", [CAR, PLANE], ids=lambda f: f.name)
def test_stations_rise_from_end_to_end_on_hundreds_of_members(family: Family) -> None:
    u, v = np.meshgrid(np.linspace(0, 1, 17), np.linspace(0, 1, 60))
    for seed in range(200):
        body = family.build(np.random.default_rng(seed))
        station = next(p.station for p in body if p.slot in ("body", "fuselage"))
        assert station is not None
        s = station(u.ravel(), v.ravel()).reshape(u.shape)
        assert (np.diff(s, axis=0) > 0).all()
        np.testing.assert_allclose(s[[0, -1]], np.array([[0.0], [1.0]]) + 0 * s[:2], atol=1e-12)


def test_semantic_stations_pass_through_the_knots() -> None:
    station = semantic_station(
        ([0, 0.3, 0.6, 1], [0, 0.1, 0.8, 1]), ([0, 0.5, 1], [0, 0.2, 1]), (0.1, 0.2)
    )
    np.testing.assert_allclose(station(np.zeros(4), np.array([0, 0.3, 0.6, 1])), [0, 0.1, 0.8, 1])
    np.testing.assert_allclose(station(np.full(3, 0.7), np.array([0, 0.5, 1])), [0, 0.2, 1])
