"""Points and directions mapped from one box to another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import nrdf
from builders.scaled_box import SCALE, UP, scaled_reference
from builders.taught_box import SIZE, cloud, faces
from nrdf.geometry.similarity import Similarity
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


def test_what_is_fixed_moves_with_the_whole_object_only(model):
    reference = scaled_reference(model, cloud(), SCALE)
    turned = Rotation.from_rotvec([0.0, 0.7, 0.3])
    pose = Similarity(turned.as_matrix(), np.array([1.0, 2.0, 3.0]), 1.0)
    own = model.encode(cloud(SIZE * SCALE, seed=1))
    there = replace(own, pose=own.pose.then(pose))
    correspondence = Correspondence(reference, there)
    given = np.array([1.0, 0.0, 1.0])
    expected = turned.apply(given) / np.sqrt(2.0)
    np.testing.assert_allclose(correspondence.turn_direction(given), expected, atol=1e-9)
    centre = correspondence.move_point(np.zeros(3))
    np.testing.assert_allclose(centre, pose.translation, atol=0.01)
    moved = correspondence.move_point(given) - centre
    np.testing.assert_allclose(moved, correspondence.scale * turned.apply(given), atol=1e-9)
