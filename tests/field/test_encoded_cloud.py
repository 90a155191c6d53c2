"""A cloud as a field sees it: frames, index spaces, sheets of unknown side."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.encoded import as_encoded
from builders.solids import box
from nrdf.field.encoded_cloud import EncodedCloud, encoder_subset
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.normals import oriented_features
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud


@pytest.fixture
def encoded() -> EncodedCloud:
    """Twelve points in a row, every second one in use."""
    pose = Similarity(rotation_about_up(0.5), np.array([3.0, -1.0, 2.0]), 4.0)
    canonical = np.stack([np.linspace(-0.5, 0.5, 12), np.zeros(12), np.zeros(12)], 1)
    cloud = PointCloud(pose.to_scan(canonical))
    working = np.arange(0, 12, 2)
    normals = np.tile([0.0, 1.0, 0.0], (6, 1))
    return EncodedCloud(cloud, working, canonical[::2], normals, pose, torch.zeros(1, 3))


def test_frames_undo_each_other(encoded):
    there = encoded.original(encoded.points)
    np.testing.assert_allclose(there, encoded.cloud.points[::2], atol=1e-12)
    np.testing.assert_allclose(encoded.canonical(there), encoded.points, atol=1e-12)
    normals = encoded.original_normals(encoded.normals)
    np.testing.assert_allclose(encoded.canonical_normals(normals), encoded.normals, atol=1e-12)


def test_points_that_are_not_in_use_follow_their_nearest(encoded):
    selected = np.zeros(6, bool)
    selected[[0, 5]] = True
    index, follows = encoded.to_all(selected)
    assert {0, 10, 11} <= set(index.tolist()) <= {0, 1, 9, 10, 11}
    assert follows[index == 0].tolist() == [0] and follows[index == 11].tolist() == [5]


def test_distance_counts_position_and_normal(encoded):
    up, down = encoded.normals[:1], -encoded.normals[:1]
    assert encoded.distance(encoded.points[:1], up)[0] == pytest.approx(0.0)
    assert encoded.distance(encoded.points[:1], down)[0] == pytest.approx(0.2)
    assert encoded.nearest(encoded.points[2:3], up, 3)[0, 0] == 2
    assert oriented_features(encoded.points, encoded.normals, 0.0).shape == (6, 3)


def test_the_encoder_sees_the_extreme_points():
    points = np.random.default_rng(0).normal(size=(2000, 3))
    chosen = encoder_subset(points, 100)
    assert 100 <= len(chosen) <= 106 and len(np.unique(chosen)) == len(chosen)
    np.testing.assert_array_equal(np.ptp(points[chosen], axis=0), np.ptp(points, axis=0))


def test_alike_features_tell_a_leg_from_a_rail_whichever_cloud_it_is_on():
    def encode(*sizes):
        clouds = [box(size, 800, seed=i, centre=(0.4 * i, 0, 0)) for i, size in enumerate(sizes)]
        return as_encoded(*(np.concatenate(both) for both in zip(*clouds, strict=True)))

    leg, rail = (0.04, 0.6, 0.04), (0.04, 0.04, 0.6)
    own, others = encode(leg, rail).alike_features(encode(rail, leg))
    assert own.shape == others.shape == (1600, 3)
    means = [features.reshape(2, 800, 3).mean(axis=1) for features in (own, others)]
    assert np.linalg.norm(means[0] - means[1][::-1], axis=1).max() < 0.1
    assert np.linalg.norm(means[0] - means[1], axis=1).min() > 0.6
