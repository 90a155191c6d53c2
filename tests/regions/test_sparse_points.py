"""Regions whose points are sparser than the reference's."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.io.cloud import PointCloud
from nrdf.regions.region import whole_region
from nrdf.regions.sparse_points import points_between


def plate(count, seed):
    """Both sides of a thin plate 1 x 1, 0.01 thick, with normals."""
    rng = np.random.default_rng(seed)
    side = np.sign(rng.uniform(-1, 1, count))
    points = np.stack([rng.uniform(0, 1, count), 0.005 * side, rng.uniform(0, 1, count)], axis=1)
    return points, np.stack([0 * side, side, 0 * side], axis=1)


def test_points_between_sparse_ones_are_in_on_their_side_alone():
    points, normals = plate(20_000, 0)
    sparse = plate(3000, 1)[0]
    inside = (sparse[:, 1] > 0) & (np.abs(sparse[:, [0, 2]] - 0.5).max(1) < 0.3)
    found = whole_region(sparse[inside], PointCloud(points, normals))
    true = (points[:, 1] > 0) & (np.abs(points[:, [0, 2]] - 0.5).max(1) < 0.3)
    is_found = np.zeros(len(points), bool)
    is_found[found] = True
    assert (is_found & true).sum() / (is_found | true).sum() > 0.9
    nearest = cKDTree(points).query(sparse[inside])[1]
    added = np.setdiff1d(found, nearest)
    assert len(added) > 2000 and (points[added, 1] > 0).mean() > 0.99


def test_own_points_and_dense_ones_stand_for_themselves():
    points, normals = plate(5000, 0)
    own = np.flatnonzero(points[:, 0] < 0.3)[::7]
    assert len(points_between(points[own], own, points, normals)) == 0
    dense = plate(6000, 2)[0]
    nearest = cKDTree(points).query(dense)[1]
    assert len(points_between(dense, nearest, points, normals)) == 0
    assert len(points_between(dense[:5], nearest[:5], points, normals)) == 0
