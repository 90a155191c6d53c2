"""Poses scored by registering an example: the right yaw, ambiguity, another kind, no example."""

from __future__ import annotations

import logging

import numpy as np
import pytest

import nrdf
from builders.scenes import full
from nrdf.errors import ModelError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import up_axis
from nrdf.io.cloud import PointCloud
from nrdf.scans.align import align_scan
from nrdf.scans.aligned_scan import align, pose_scorer

ONE, OTHER = 1_000_003, 1_000_010
YAW = 2.2


def member(seed, category="chair", yaw=0.0):
    surface, turn = full(category, seed), rotation_about_up(yaw)
    return PointCloud(surface.points @ turn.T, surface.normals @ turn.T)


@pytest.fixture(scope="module")
def model():
    return nrdf.load_model("registration")


@pytest.fixture(scope="module")
def scorer(model):
    return pose_scorer(model, [member(ONE)])


def test_a_chair_is_aligned_with_another_chair(scorer):
    found = align_scan(scorer, member(OTHER, yaw=YAW), up_axis("y"))
    apart = rotation_about_up(YAW).T @ found.best.pose.rotation
    assert np.degrees(np.arccos((np.trace(apart) - 1) / 2)) < 5
    assert not found.is_ambiguous


def test_what_looks_the_same_from_two_sides_is_ambiguous(model):
    rng = np.random.default_rng(0)
    sides = np.array([1.0, 0.6, 0.4])
    axis, sign = rng.integers(3, size=4000), rng.choice([-1.0, 1.0], 4000)
    points = rng.uniform(-0.5, 0.5, (4000, 3))
    points[np.arange(4000), axis] = 0.5 * sign
    normals = np.zeros((4000, 3))
    normals[np.arange(4000), axis] = sign
    box = PointCloud(points * sides, normals)
    found = align_scan(pose_scorer(model, [box]), box, up_axis("y"))
    assert found.is_ambiguous


@pytest.mark.parametrize(("yaw", "word"), [(np.pi, "facing -X"), (np.pi / 2, "facing")])
def test_one_that_faces_elsewhere_is_noticed(model, caplog, yaw, word):
    taught = model.set_reference(member(ONE))
    assert taught.check_kind(model.encode(member(OTHER))).fits
    with caplog.at_level(logging.WARNING):
        taught.retrieve(np.arange(500), member(OTHER, yaw=yaw))
    assert word in caplog.records[0].message and "--up y" in caplog.records[0].message


def test_an_object_of_another_kind_is_noticed(model):
    taught = model.set_reference(member(ONE))
    found = taught.check_kind(model.encode(member(ONE, "plane")))
    assert not found.fits and "does not look like a known object" in found.warnings[0]


def test_the_coarse_cost_tells_the_right_way_from_the_wrong_one(scorer):
    posed = [member(OTHER, yaw=yaw) for yaw in (0.0, np.pi)]
    costs = scorer.coarse(
        np.array([cloud.points[:512] for cloud in posed]),
        np.array([cloud.normals[:512] for cloud in posed]),
    )
    assert costs[0] < costs[1]


def test_without_an_example_nothing_can_be_aligned(model):
    with pytest.raises(ModelError, match="give an example of the kind"):
        align(model, member(OTHER))
