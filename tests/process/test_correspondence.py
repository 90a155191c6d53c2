"""Points and directions mapped from one box to another."""

from __future__ import annotations

import numpy as np
import pytest

import nrdf
from builders.scaled_box import SCALE, UP, scaled_reference
from builders.taught_box import SIZE, cloud, faces
from nrdf.process.correspondence import Correspondence


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


@pytest.fixture(scope="module")
def correspondence(model):
    reference = scaled_reference(model, cloud(), SCALE)
    return Correspondence(reference, model.encode(cloud(SIZE * SCALE, seed=1)))


def test_points_land_on_the_targets_surface(correspondence):
    top = faces(cloud())["top"]
    points, normals = cloud().points[top][:50], cloud().normals[top][:50]
    found, outward, exists = correspondence.map_points(points, normals)
    assert exists.all()
    assert np.median(np.linalg.norm(found - points * SCALE, axis=1)) < 0.015
    np.testing.assert_allclose(found[:, 1], SIZE[1] * SCALE[1] / 2, atol=2e-3)
    np.testing.assert_allclose(outward @ UP, 1.0, atol=1e-3)


def test_a_point_far_from_the_target_has_no_counterpart(correspondence):
    above = np.array([[0.0, 1.5 * SIZE[1], 0.0]])
    assert not correspondence.map_points(above, UP[None])[2].any()


def test_the_scale_is_that_of_the_longest_sides(correspondence):
    assert correspondence.scale == pytest.approx((SIZE * SCALE).max() / max(SIZE), rel=0.01)


def test_a_direction_follows_the_surface(correspondence):
    for name, given in (("top", [1.0, 0.0, 1.0]), ("front", [0.0, 2.0, 1.0])):
        there = correspondence.map_direction(faces(cloud())[name], np.array(given))
        expected = SCALE * given
        assert there @ expected / np.linalg.norm(expected) > np.cos(np.radians(3))
        assert np.linalg.norm(there) == pytest.approx(1.0)
    spot = faces(cloud())["top"][:1]
    np.testing.assert_allclose(correspondence.map_direction(spot, 3 * UP), UP)
