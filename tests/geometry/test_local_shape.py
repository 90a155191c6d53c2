"""Local shapes: known ones of planes, legs and balls, whatever the side and density of points."""

from __future__ import annotations

import numpy as np

from builders.solids import box
from nrdf.geometry.local_shape import local_shapes, telling_directions
from nrdf.geometry.sampling import fibonacci_directions


def tensors(shapes):
    """The structure tensor and the covariance, (n, 3, 3) each."""
    off = shapes.reshape(-1, 2, 6) / np.array([1, 1, 1, *[np.sqrt(2)] * 3])
    return np.moveaxis(off[:, :, [[0, 3, 4], [3, 1, 5], [4, 5, 2]]], 1, 0)


def test_a_plane_has_one_direction_of_normals_and_two_of_points():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (40000, 3)) * [1, 0, 1]
    inner = np.abs(points).max(axis=1) < 0.4
    normals, spread = tensors(local_shapes(points, np.tile([0.0, 1.0, 0.0], (40000, 1))))
    np.testing.assert_allclose(normals, np.tile(np.diag([0.0, 1.0, 0.0]), (40000, 1, 1)), atol=1e-9)
    # Even in a disc of radius r a coordinate's variance is r² / 4, times 3 / r².
    expected = np.diag([0.75, 0.0, 0.75])
    assert np.abs(spread[inner].mean(axis=0) - expected).max() < 0.05
    assert np.abs(spread[inner] - expected).max() < 0.15


def test_the_distance_of_two_shapes_is_that_of_their_matrices():
    points, normals = box((0.5, 0.05, 0.4), 3000)
    shapes = local_shapes(points, normals)
    one, other = shapes[:1500], shapes[1500:]
    matrices = np.stack(tensors(one)) - np.stack(tensors(other))
    expected = np.sqrt((matrices**2).sum(axis=(0, 2, 3)))
    np.testing.assert_allclose(np.linalg.norm(one - other, axis=1), expected, atol=1e-12)


def test_legs_that_stand_are_alike_and_unlike_those_that_lie():
    leg, leg_normals = box((0.04, 0.6, 0.04), 3000)
    thicker, thicker_normals = box((0.05, 0.5, 0.05), 3000, seed=1, centre=(0.3, 0.1, 0.2))
    rail, rail_normals = box((0.6, 0.04, 0.04), 3000, seed=2)
    standing, lying = local_shapes(leg, leg_normals), local_shapes(rail, rail_normals)
    alike = local_shapes(thicker, thicker_normals)
    middle = np.abs(leg[:, 1]) < 0.2, np.abs(thicker[:, 1] - 0.1) < 0.2, np.abs(rail[:, 0]) < 0.2
    mean, other, crossed = (
        shapes[chosen].mean(axis=0)
        for shapes, chosen in zip((standing, alike, lying), middle, strict=True)
    )
    assert np.linalg.norm(mean - other) < 0.15
    assert np.linalg.norm(mean - crossed) > 0.8


def test_neither_the_side_of_normals_nor_the_density_of_points_matters():
    directions = fibonacci_directions(20000)
    points = 0.3 * directions
    before = local_shapes(points, directions)
    sign = np.where(np.random.default_rng(0).random(20000) < 0.5, -1.0, 1.0)[:, None]
    np.testing.assert_allclose(local_shapes(points, sign * directions), before, atol=1e-12)
    # The same points, those on one side five times: cells count the same.
    again = np.concatenate([points, np.repeat(points[points[:, 0] > 0], 4, axis=0)])
    more = local_shapes(again, again / 0.3)
    apart = np.abs(points[:, 0]) > 0.1  # from cells of which only some points are repeated
    np.testing.assert_allclose(more[:20000][apart], before[apart], atol=1e-9)


def test_points_far_apart_are_on_their_own():
    shapes = local_shapes(np.diag([1.0, 2.0, 3.0]), np.eye(3))
    expected = np.zeros((3, 12))
    expected[:, :3] = np.eye(3)
    np.testing.assert_allclose(shapes, expected, atol=1e-12)


def test_the_telling_directions_keep_most_of_what_differs():
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.normal(size=(12, 12)))[0]
    shapes = rng.normal(size=(500, 12)) * [3.0, 2.0, 1.5, *[0.1] * 9] @ basis.T + 5.0
    directions = telling_directions(shapes)
    np.testing.assert_allclose(directions.T @ directions, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(np.abs(np.diag(directions.T @ basis[:, :3])), 1.0, atol=0.01)
