"""How well a field explains clouds in hypothesised poses."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import UP, full, pose, scorer, yaw_error
from nrdf.errors import ModelError
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.scans.align import align_scan
from nrdf.scans.field_pose_scorer import FieldPoseScorer, family_prototypes
from nrdf.scans.pose_scorer import sparse_subset

CHAIR = 1_000_003
PLACE = pose(2.2, 900.0, (300, -50, 20))


def test_the_right_pose_costs_least():
    surface = full("chair", CHAIR)
    chosen = sparse_subset(surface.points, 512)
    points, normals = surface.points[chosen], surface.normals[chosen]
    turns = [np.eye(3), np.diag([-1.0, 1.0, -1.0]), np.diag([1.0, -1.0, -1.0])]
    posed = np.array([points @ t for t in turns]), np.array([normals @ t for t in turns])
    for costs in (scorer("chair").coarse(*posed), scorer("chair").fine(*posed, *posed)):
        assert costs.shape == (3,) and costs.argmin() == 0


def test_a_member_costs_what_is_usual_and_has_usual_proportions():
    ours, surface = scorer("chair"), full("chair", CHAIR)
    target = ours.model.encode(PointCloud(surface.points, surface.normals))
    assert ours.cost_of(target) < ours.usual_cost + 0.2
    assert ours.proportion_z_score(target.points) < scorer("chair").largest_z_score
    assert (
        ours.proportion_z_score(target.points * [1.0, 0.3, 1.0]) > scorer("chair").largest_z_score
    )


def test_a_sparse_subset_keeps_the_extremes():
    points = np.random.default_rng(1).normal(size=(3000, 3))
    chosen = sparse_subset(points, 200)
    assert len(chosen) == len(np.unique(chosen)) == 200
    assert {*points.argmin(0), *points.argmax(0)} & {*chosen}


def test_a_category_without_a_family_needs_an_example():
    with pytest.raises(ModelError, match=r"'teapot' has no parametric family.*give a --reference"):
        family_prototypes("teapot")
    model = scorer("chair").model
    other = Model(model.field, {"category": "teapot"})
    example = full("chair", 1_000_009)
    found = align_scan(
        FieldPoseScorer(other, [PointCloud(example.points, example.normals)]),
        PointCloud(PLACE.to_scan(full("chair", CHAIR).points)),
        UP,
    )
    assert yaw_error(found.best.pose, PLACE) < 5
