"""Poses scored by registering known objects: the right yaw, ambiguity, another kind, no example."""

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
from nrdf.scans.aligned_scan import align
from nrdf.scans.pose_scorer import (
    COST_MARGIN,
    LARGEST_Z_SCORE,
    PROTOTYPES,
    USUAL_COST,
    PoseScorer,
    even_subset,
    family_prototypes,
    sparse_subset,
)

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
    return PoseScorer(model, [member(ONE)])


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
    found = align_scan(PoseScorer(model, [box]), box, up_axis("y"))
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
    with pytest.raises(ModelError, match="alignment needs an example: give a --reference"):
        align(model, member(OTHER))


def test_subsets_are_of_the_size_asked_for_and_distinct():
    points = member(ONE).points
    for subset in (sparse_subset(points, 200), even_subset(points, 200)):
        assert 150 < len(subset) <= 200 and len(np.unique(subset)) == len(subset)
    extremes = {int(points[:, axis].argmax()) for axis in range(3)}
    assert extremes <= set(sparse_subset(points, len(points)).tolist())


def test_proportions_are_told_in_standard_deviations():
    cloud = member(ONE)
    scorer = PoseScorer(nrdf.load_model("registration"), [cloud])
    points = scorer.model.encode(cloud).points
    assert scorer.proportion_z_score(points) == pytest.approx(0.0)
    assert scorer.proportion_z_score(points * [3.0, 1.0, 1.0]) > 3
    assert scorer.name == "known object"


def test_members_of_the_family_stand_in_for_examples():
    with pytest.raises(ModelError, match=r"'teapot' has no parametric family.*give a --reference"):
        family_prototypes("teapot")
    scorer = PoseScorer(nrdf.load_model("chair"))
    assert scorer.prototypes == PROTOTYPES and scorer.name == "chair"
    target = scorer.model.encode(member(ONE))
    assert scorer.cost_of(target) < USUAL_COST + COST_MARGIN
    assert scorer.proportion_z_score(target.points) < LARGEST_Z_SCORE
    assert scorer.proportion_z_score(target.points * [1.0, 0.1, 1.0]) > LARGEST_Z_SCORE
