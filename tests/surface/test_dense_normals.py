"""Normals of all points of a scan: the two sides of a thin slat stay apart."""

import numpy as np

from nrdf.surface.dense_normals import dense_normals


def slat(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points and outward normals of the two sides of a slat 0.4 m by 0.04 m, 10 mm thick."""
    side = rng.integers(0, 2, count)
    points = rng.uniform([0.0, 0.0, 0.0], [0.4, 0.04, 0.0], (count, 3))
    points[:, 2] = 0.01 * side
    return points, np.stack([0 * side, 0 * side, 2.0 * side - 1.0], axis=1)


def test_sides_of_a_slat_thinner_than_the_few_points_are_apart():
    rng = np.random.default_rng(0)
    few, normals = slat(150, rng)
    points, truth = slat(20_000, rng)
    points = points + rng.normal(0.0, 3e-4, points.shape)
    nearest = normals[((points[:, None] - few) ** 2).sum(axis=2).argmin(axis=1)]
    found = dense_normals(points, few, normals)
    assert (np.einsum("na,na->n", nearest, truth) < 0.0).mean() > 0.1
    assert (np.einsum("na,na->n", found, truth) < 0.0).mean() < 0.01
    assert (np.einsum("na,na->n", found, truth) < 0.5).mean() < 0.03


def test_sensors_tell_the_sides_where_the_few_are_wrong():
    rng = np.random.default_rng(0)
    few, normals = slat(150, rng)
    points, truth = slat(20_000, rng)
    sensors = np.array([[0.2, 0.02, 2.0], [0.2, 0.02, -2.0]])
    found = dense_normals(points, few, -normals, sensors)
    assert (np.einsum("na,na->n", found, truth) < 0.5).mean() < 0.01


def test_few_points_take_the_nearest():
    rng = np.random.default_rng(0)
    few, normals = slat(150, rng)
    assert (dense_normals(few, few, normals) == normals).all()
