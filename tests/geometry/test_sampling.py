"""Fewer points, evenly spread, and directions evenly spread."""

from __future__ import annotations

import time

import numpy as np
import pytest

from builders.oriented_clouds import sphere
from nrdf.geometry.sampling import (
    distinct_points,
    downsample,
    fibonacci_directions,
    indices_in_subset,
    spread_in_triangles,
)


def test_directions_are_unit_and_even():
    directions = fibonacci_directions(60)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.linalg.norm(directions.mean(axis=0)) < 0.01
    cosine = directions @ directions.T - 2 * np.eye(60)
    assert np.degrees(np.arccos(cosine.max(axis=1))).min() > 20


@pytest.mark.parametrize(
    "count", [pytest.param(5, id="few"), pytest.param(1000, id="some"), 19_999, 20_000, 30_000]
)
def test_thinning_keeps_as_many_points_as_asked(count):
    points, _ = sphere(np.random.default_rng(0), 20_000)
    index = downsample(points, count, np.random.default_rng(1))
    assert len(index) == min(count, 20_000) == len(set(index))
    assert (np.diff(index) > 0).all()


def test_thinning_evens_out_the_density():
    rng = np.random.default_rng(0)
    points, _ = sphere(rng, 60_000)
    dense_above = points[(points[:, 1] > 0) | (rng.random(60_000) < 0.03)]
    above = dense_above[downsample(dense_above, 400, rng), 1] > 0
    assert (dense_above[:, 1] > 0).mean() > 0.95
    assert 0.4 < above.mean() < 0.65


def test_thinning_copes_with_coincident_points():
    points = np.repeat(np.eye(3), 50, axis=0)
    assert len(downsample(points, 10, np.random.default_rng(0))) == 10
    assert len(downsample(np.zeros((100, 3)), 10, np.random.default_rng(0))) == 10


def test_thinning_ten_million_points_is_quick():
    points = np.random.default_rng(0).random((10_000_000, 3), dtype=np.float32)
    points[:, 1] = 0.0
    start = time.process_time()
    index = downsample(points, 8192, np.random.default_rng(1))
    assert time.process_time() - start < 8.0  # 2 s on an idle core
    for corner in (points[index] < 0.25, points[index] > 0.75):
        assert corner[:, [0, 2]].all(axis=1).mean() == pytest.approx(1 / 16, rel=0.2)


def test_thinning_takes_points_that_fill_a_volume():
    points = np.random.default_rng(0).random((300_000, 3))
    index = downsample(points, 1000, np.random.default_rng(1))
    assert len(index) == 1000
    assert (points[index] < 0.5).all(axis=1).mean() == pytest.approx(1 / 8, abs=0.04)


def test_of_points_in_one_place_one_stays_for_each_side():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 1e-9], [1, 0, 0]])
    up = np.array([0.0, 0.0, 1.0])
    assert distinct_points(points).tolist() == [0, 1]
    normals = np.stack([up, up, up, up, -up])
    assert distinct_points(points, normals).tolist() == [0, 1, 4]
    different = np.arange(12.0).reshape(4, 3)
    assert distinct_points(different).tolist() == [0, 1, 2, 3]


def test_indices_become_positions_in_a_subset():
    subset = np.array([1, 4, 6, 8])
    assert indices_in_subset(subset, np.array([8, 4, 5, 4]), 10).tolist() == [1, 3]
    assert indices_in_subset(subset, np.array([], int), 10).tolist() == []


def test_places_lie_in_their_triangles_and_fill_them_evenly():
    triangle = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
    places = spread_in_triangles(np.tile(triangle, (1000, 1, 1)))
    assert (places[:, :2] >= 0.0).all() and (places.sum(axis=1) <= 1.0).all()
    for axis in range(2):  # the quarter of the area in each of these corners
        assert abs((places[:, axis] > 0.5).mean() - 0.25) < 0.01
    assert abs((places.sum(axis=1) < 0.5).mean() - 0.25) < 0.01
    np.testing.assert_allclose(places.mean(axis=0), [1 / 3, 1 / 3, 0], atol=0.005)
