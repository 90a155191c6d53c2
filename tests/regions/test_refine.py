"""Refinement from where a field has put a reference, against exact truth."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from nrdf.field import build_field
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.regions.refine import Refiner
from nrdf.shapes.families import get_family


@pytest.fixture(scope="module")
def chairs():
    """One chair, sampled twice."""
    member = get_family("chair").member(0)
    return [member.sample_surface(3000, np.random.default_rng(draw)) for draw in (0, 1)]


def test_a_map_that_is_off_smoothly_is_brought_back(chairs):
    reference, target = chairs
    off = 0.03 * np.sin(3 * reference.points[:, [1, 2, 0]]) + [0.02, -0.01, 0.0]
    refiner = Refiner(reference.points, reference.normals)
    moved = refiner.displacement(
        reference.points + off, reference.normals, target.points, target.normals
    )
    assert moved.shape == (3000, 3)
    left = np.linalg.norm(off + moved, axis=1).mean()
    assert left < 0.5 * np.linalg.norm(off, axis=1).mean()


def test_a_map_that_is_right_stays(chairs):
    reference, target = chairs
    refiner = Refiner(reference.points, reference.normals)
    moved = refiner.displacement(reference.points, reference.normals, target.points, target.normals)
    assert np.linalg.norm(moved, axis=1).mean() < 0.01


@pytest.mark.parametrize("method", ["mask", "points"])
def test_retrieval_follows_it(chairs, method):
    torch.manual_seed(0)
    model = Model(build_field("default", {"encoder_points": 64}), {"category": "chair"})
    with torch.no_grad():  # the field shifts everything, and says that it may be off
        model.field.inverse.leave.bias[1] = 0.04
        model.field.inverse.leave.bias[7] = 1.0
    reference, target = (PointCloud(100 * c.points, c.normals) for c in chairs)
    region = np.flatnonzero(reference.normals[:, 1] > 0.7)
    taught = model.set_reference(reference)
    truth = reference.points[region]
    plain, refined = (
        taught.retrieve(region, target, method, refine=refine) for refine in (False, True)
    )
    shift = np.median(plain.points - truth, axis=0)
    np.testing.assert_allclose(shift, [0.0, 4.0, 0.0], atol=0.1)
    assert abs(np.median((refined.points - truth)[:, 1])) < 0.3 * shift[1]
