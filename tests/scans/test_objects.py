"""Objects side by side are told apart; what is one object stays one."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from builders.scenes import UP, pose, scan_of
from builders.solids import box
from nrdf.geometry.mesh import clean_mesh, outer_skin
from nrdf.io.cloud import PointCloud
from nrdf.scans.clean import clean_scan
from nrdf.scans.objects import count_objects, separate_objects
from nrdf.shapes.families import get_family

IKEA = Path(__file__).parents[2] / ".." / "shared" / "objects" / "ikea"
CANONICAL_UP = np.array([0.0, 1.0, 0.0])


def family_cloud(category: str, seed: int, count: int) -> np.ndarray:
    return get_family(category).member(seed).sample_surface(count, np.random.default_rng(0)).points


def turned(points: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Points in a random pose and up in it."""
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    return 3.0 * points @ rotation.T + [5.0, -7.0, 100.0], rotation[:, 1]


def beside(one: np.ndarray, other: np.ndarray, gap: float) -> np.ndarray:
    """Both on one floor, the other to the right, `gap` of a longest side away."""
    size = max(np.ptp(one, axis=0).max(), np.ptp(other, axis=0).max())
    other = other.copy()
    other[:, 1] += one[:, 1].min() - other[:, 1].min()
    other[:, 2] += one[:, 2].max() - other[:, 2].min() + gap * size
    return np.concatenate([one, other])


@pytest.mark.parametrize("count", [2048, 8192, 30_000])
@pytest.mark.parametrize("category", ["chair", "car", "plane", "table"])
def test_a_single_object_is_one(category, count):
    for seed in (1_000_000, 1_000_003):
        points, up = turned(family_cloud(category, seed, count), seed)
        assert count_objects(PointCloud(points)) == 1
        assert count_objects(PointCloud(points), up) == 1


@pytest.mark.parametrize("gap", [0.05, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("known", [True, False])
def test_two_chairs_side_by_side_are_two(gap, known):
    one, other = (family_cloud("chair", seed, 8192) for seed in (1_000_000, 1_000_003))
    points, up = turned(beside(one, other, gap))
    label = separate_objects(points, up if known else None)
    assert label.max() == 1
    assert len(set(label[:8192])) == len(set(label[8192:])) == 1


def test_three_are_three_and_a_cup_beside_a_chair_is_none():
    one, other = (family_cloud("chair", seed, 8192) for seed in (1_000_000, 1_000_003))
    points = beside(beside(one, other, 0.1), one, 0.1)
    assert count_objects(PointCloud(points), CANONICAL_UP) == 3
    cup = box(np.full(3, 0.1), 500)[0]
    assert count_objects(PointCloud(beside(one, cup, 0.2)), CANONICAL_UP) == 1


@pytest.mark.parametrize("up", [UP, None])
@pytest.mark.parametrize("gap", [0.1, 0.5])
def test_cleaning_keeps_one_of_two_that_stand_close(gap, up):
    one = scan_of("chair", 1_000_004, pose(0.0)).cloud.points
    other = scan_of("chair", 1_000_000, pose(0.0)).cloud.points
    right = np.cross(UP, [1.0, 0.0, 0.0])
    other = other + ((one @ right).max() - (other @ right).min() + gap) * right
    cleaned = clean_scan(PointCloud(np.concatenate([one, other])), up)
    assert cleaned.others == 1
    assert (cleaned.kept < len(one)).mean() in (0.0, 1.0)
    assert "largest of 2 objects" in cleaned.steps[-1].note


def test_parts_over_each_other_are_one_object():
    top, _ = box([1.0, 0.04, 0.6], 4000, centre=(0, 0.8, 0))
    frame, _ = box([0.9, 0.4, 0.5], 4000, seed=1, centre=(0, 0.2, 0))
    points = np.concatenate([top, frame])  # the legs between them were not seen
    assert count_objects(PointCloud(points), CANONICAL_UP) == 1
    assert count_objects(PointCloud(points)) == 1


@pytest.mark.skipif(not IKEA.is_dir(), reason="the IKEA set is not beside this checkout")
def test_real_chairs_are_one_and_pairs_of_them_two():
    files = sorted((IKEA / "chair").glob("*.npz"))[::4]
    clouds = []
    for file in files:
        with np.load(file) as content:
            mesh = clean_mesh(content["vertices"].astype(float), content["faces"].astype(int))
        clouds.append(outer_skin(*mesh, 8192, np.random.default_rng(0))[1].points)
    for one, other in zip(clouds, clouds[1:] + clouds[:1], strict=True):
        assert count_objects(PointCloud(turned(one)[0])) == 1
        points, up = turned(beside(one, other, 0.06))
        assert count_objects(PointCloud(points), up) == count_objects(PointCloud(points)) == 2


def test_very_many_points_close_together_take_no_memory():
    cluster = 0.01 * np.random.default_rng(0).normal(size=(7000, 3))
    chair = np.concatenate([family_cloud("chair", 1_000_000, 1000), cluster])
    tracemalloc.start()
    try:
        for points in (chair, np.zeros((9000, 3))):
            assert count_objects(PointCloud(points)) == 1
        assert tracemalloc.get_traced_memory()[1] < 100e6, "not every pair of them"
    finally:
        tracemalloc.stop()
