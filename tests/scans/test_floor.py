"""The plane that an object stands on."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.scans.floor import Plane, find_floor
from nrdf.shapes.families import get_family

UP = np.array([0.0, 1.0, 0.0])


def scene() -> np.ndarray:
    """A box of 0.4 m on a floor of 2 m, at height 3."""
    rng = np.random.default_rng(0)
    floor = rng.uniform([-1, 3, -1], [1, 3.001, 1], (4000, 3))
    return np.vstack([floor, rng.uniform([-0.2, 3, -0.2], [0.2, 3.4, 0.2], (3000, 3))])


@pytest.mark.parametrize("up", [UP, None])
def test_a_floor_is_found_with_and_without_up(up):
    plane = find_floor(scene(), up, np.random.default_rng(0))
    assert plane is not None and plane.offset == pytest.approx(3.0, abs=0.01)
    np.testing.assert_allclose(plane.normal, UP, atol=0.01)
    height = plane.height(np.array([[0.3, 3.5, 0.1]]))
    assert height[0] == pytest.approx(0.5, abs=0.02) and plane.thickness < 0.02


def test_height_is_measured_along_the_normal():
    plane = Plane(np.array([0.0, 0.6, 0.8]), 2.0, 0.01)
    np.testing.assert_allclose(plane.height(np.array([[5.0, 0.6, 0.8], [0, 0, 2.5]])), [-1, 0])


@pytest.mark.parametrize("category", ["chair", "car", "plane", "table"])
def test_no_part_of_an_object_passes_for_a_floor(category):
    for seed in range(1_000_000, 1_000_004):
        points = get_family(category).member(seed).sample_surface(6000, np.random.default_rng(0))
        assert find_floor(points.points, np.array([0, 1.0, 0]), np.random.default_rng(0)) is None
