"""Poses of a scan, with the zoo's weights: yaw, scale and centre, and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import UP, full, pose, scorer, yaw_error
from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud
from nrdf.scans.align import Alignment, Candidate, align_scan
from nrdf.scans.field_pose_scorer import FieldPoseScorer

CHAIR = 1_000_003
PLACE = pose(2.2, 900.0, (300, -50, 20))


@pytest.mark.parametrize("category", ["chair", "car", "plane"])
def test_a_full_cloud_is_found_in_any_pose(category):
    points = PLACE.to_scan(full(category, CHAIR).points)
    found = align_scan(scorer(category), PointCloud(points), UP)
    best = found.best
    assert yaw_error(best.pose, PLACE) < 2
    assert best.pose.scale == pytest.approx(PLACE.scale, rel=0.02)
    np.testing.assert_allclose(best.pose.translation, PLACE.translation, atol=0.01 * 900)
    assert np.linalg.det(best.pose.rotation) == pytest.approx(1)
    assert best.symmetry > 0.9
    assert sum(c.probability for c in found.candidates) == pytest.approx(1)
    assert [c.cost for c in found.candidates] == sorted(c.cost for c in found.candidates)
    yaw = np.degrees(best.yaw - 2.2) % 360
    assert min(yaw, 360 - yaw) < 2 and np.allclose(best.up, UP)


class Facing:
    """Says that everything is turned by one yaw (rad), this sure of it."""

    def __init__(self, yaw: float, sure: float) -> None:
        self.told = sure * np.cos(2 * np.pi / 36 * np.arange(36) - yaw)

    def log_probability(self, points, normals):
        assert points.shape == normals.shape and len(points) > 512
        return self.told


@pytest.mark.parametrize(("way", "sure", "turned"), [(2.2, 3, 0), (2.2 + np.pi, 60, 180)])
def test_what_faces_the_other_way_is_told_by_field_and_network_together(way, sure, turned):
    points = PLACE.to_scan(full("car", CHAIR).points)
    asked = FieldPoseScorer(scorer("car").model, yaw=Facing(way, sure))
    found = align_scan(asked, PointCloud(points), UP)
    assert yaw_error(found.best.pose, PLACE) == pytest.approx(turned, abs=2)
    other = next(c for c in found.candidates if yaw_error(c.pose, found.best.pose) > 170)
    assert other.probability < 0.3 and other.cost > other.field_cost
    assert found.best.cost == pytest.approx(found.best.field_cost, abs=0.01)


def test_likely_poses_are_those_that_no_other_one_beats_clearly():
    poses = [
        Candidate(pose(0.1 * i), UP, 0.1 * i, 0.0, 1.0, p) for i, p in enumerate((0.5, 0.4, 0.1))
    ]
    assert Alignment(tuple(poses)).is_ambiguous
    assert Alignment(tuple(poses)).likely == tuple(poses[:2])
    assert not Alignment((poses[0], poses[2])).is_ambiguous


def test_an_unusable_scan_is_refused():
    with pytest.raises(CloudError, match="has 10 points; at least 256"):
        align_scan(scorer("chair"), PointCloud(np.random.default_rng(0).random((10, 3))), UP)
