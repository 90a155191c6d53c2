"""Regions in all their forms, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from nrdf.errors import RegionError
from nrdf.io.cloud import PointCloud
from nrdf.regions.region import region_indices


@pytest.fixture(scope="module")
def reference() -> PointCloud:
    points = np.random.default_rng(0).uniform(size=(200, 3)) * [1000.0, 500.0, 300.0]
    points[0], points[1] = 0.0, [1000.0, 500.0, 300.0]
    return PointCloud(points, unit="mm")


def test_a_mask_gives_its_points(reference):
    mask = np.zeros(200, bool)
    mask[[3, 77, 12]] = True
    assert region_indices(mask, reference).tolist() == [3, 12, 77]
    assert region_indices(mask.tolist(), reference).tolist() == [3, 12, 77]


def test_indices_keep_their_order_and_repetitions(reference):
    assert region_indices([9, 2, 9, 199, 0], reference).tolist() == [9, 2, 9, 199, 0]
    found = region_indices(np.array([9, 2], np.uint8), reference)
    assert found.dtype == np.int64 and found.tolist() == [9, 2]


@pytest.mark.parametrize("wrap", [np.asarray, PointCloud, np.float32, np.ndarray.tolist])
def test_points_stand_for_the_nearest_ones_in_their_order(reference, wrap):
    chosen = np.array([150, 3, 42, 3])
    away = np.random.default_rng(1).normal(size=(4, 3))
    away *= 0.01 / np.linalg.norm(away, axis=1, keepdims=True)
    assert region_indices(wrap(reference.points[chosen] + away), reference).tolist() == [
        *chosen.tolist()
    ]


def test_three_integer_points_are_points_and_not_indices(reference):
    cloud = PointCloud(np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]))
    assert region_indices([[0, 0, 10], [10, 0, 0]], cloud).tolist() == [3, 1]


def test_a_kept_tree_is_asked_only_for_points(reference):
    asked = []

    def tree():
        asked.append(1)
        return cKDTree(reference.points)

    region_indices([1, 2], reference, tree)
    assert not asked
    assert region_indices(reference.points[[5]], reference, tree).tolist() == [5]
    assert asked == [1]


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ([], "the region is empty"),
        (np.zeros((0, 3)), "the region is empty"),
        (np.zeros(200, bool), "mask is False everywhere; mark at least one point"),
        (np.ones(199, bool), r"each of the reference's 200 points, not shape \(199,\)"),
        (np.ones((200, 1), bool), r"not shape \(200, 1\)"),
        ([0, 200], "indices must lie in 0 to 199, not 0 to 200"),
        ([-1, 5], "indices must lie in 0 to 199, not -1 to 5"),
        ([0.0, 1.0], r"not an array of float64 of shape \(2,\)"),
        (np.zeros((4, 2)), r"a region is a boolean mask .* of shape \(4, 2\)"),
        (np.zeros((2, 2), int), r"not an array of int64 of shape \(2, 2\)"),
        (["seat", "back"], "a region is a boolean mask"),
        ([[0, 0, 0], [1, 1]], "the region is no array"),
        ([[0.0, 0, np.nan]], "not finite; remove those points"),
        ([[np.inf, 0, 0]], "not finite"),
    ],
)
def test_what_is_no_region_is_refused(reference, region, message):
    with pytest.raises(RegionError, match=message):
        region_indices(region, reference)


def test_points_off_the_reference_are_refused_with_how_far_they_are(reference):
    near = reference.points[1] + [19.0, 0, 0]  # the longest side is 1000
    assert region_indices([near], reference).tolist() == [1]
    far = reference.points[1] + [55.0, 0, 0]
    with pytest.raises(RegionError) as caught:
        region_indices([near, far, reference.points[5]], reference)
    said = str(caught.value)
    assert "1 of the region's 3 points are not on the reference" in said
    assert "55 away" in said and "5.5 % of its longest side, 1000" in said and "2 %" in said
    assert "same frame and unit" in said
