"""Poses of a scan, with the zoo's weights: yaw, scale and centre, and how sure they are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.scenes import UP, full, pose, scorer, yaw_error
from nrdf.errors import CloudError
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf.scans.align import Alignment, Candidate, align_scan

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


def test_an_object_that_lies_askew_is_found_by_the_box_around_it():
    turn = Rotation.from_euler("xyz", (100, 25, 40), degrees=True).as_matrix()
    place = Similarity(turn, np.array([300.0, -200.0, 900.0]), 850.0)
    points = place.to_scan(full("chair", CHAIR).points)
    found = align_scan(scorer("chair"), PointCloud(points))
    # The back of this one leans, and so does the smallest box: 11 degrees.
    assert yaw_error(found.best.pose, place) < 12 and found.best.probability > 0.9
