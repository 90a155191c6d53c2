"""A camera's rays, projection, and rectangles on the screen."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.bundled import bundled_chair
from nrdf.studio.model.paintable_cloud import PaintableCloud
from nrdf.studio.scene.camera import Camera, first_hit, points_in_rectangle


@pytest.fixture(scope="module")
def chair():
    cloud, regions = bundled_chair("reference")
    return PaintableCloud(cloud), regions


def middle(body, mask):
    points = body.points[mask]
    return int(
        np.flatnonzero(mask)[np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    )


@pytest.fixture
def from_the_front():
    # Looks along -X from x = 2: right is -Z, up is +Y.
    rotation = np.array([[0.0, 0, -1], [0, -1, 0], [-1, 0, 0]])
    return Camera(np.array([2.0, 0.45, 0.0]), rotation, np.radians(48), 1.5)


def test_rays_and_projection_agree(from_the_front):
    points = np.array([[0.0, 0.9, 0.3], [0.5, 0.2, -0.4], [-0.3, 0.45, 0.0]])
    places, depths = from_the_front.project(points)
    for point, place, depth in zip(points, places, depths, strict=True):
        ray = from_the_front.ray(tuple(place))
        met = from_the_front.position + ray * np.linalg.norm(point - from_the_front.position)
        np.testing.assert_allclose(met, point, atol=1e-9)
        assert depth == pytest.approx(2.0 - point[0])
    assert places[0][0] < 0.5 and places[0][1] < 0.5, "+Z is left, +Y up"


def test_quaternions_come_scalar_first():
    view = Camera.of(np.zeros(3), np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)]), 1.0, 1.0)
    np.testing.assert_allclose(view.rotation @ [1.0, 0, 0], [0, 1, 0], atol=1e-12)


def test_a_ray_meets_the_side_that_faces_it(chair, from_the_front):
    body, regions = chair
    spacing = body.surface.spacing
    target = body.points[middle(body, regions["back-front"])]
    ray = target - from_the_front.position
    ray /= np.linalg.norm(ray)
    index, depth = first_hit(body.points, body.normals, from_the_front.position, ray, spacing)
    assert regions["back-front"][index]
    assert depth == pytest.approx(np.linalg.norm(target - from_the_front.position), abs=0.03)
    assert first_hit(body.points, body.normals, from_the_front.position, -ray, spacing) is None


def test_a_box_takes_what_is_seen_or_all(chair, from_the_front):
    body, regions = chair
    spacing, corners = body.surface.spacing, ((0.4, 0.45), (0.6, 0.02))
    seen = points_in_rectangle(from_the_front, body.points, body.normals, corners, spacing)
    every = points_in_rectangle(
        from_the_front, body.points, body.normals, corners, spacing, through=True
    )
    assert (seen & regions["back-front"]).sum() > 0.9 * (every & regions["back-front"]).sum() > 100
    assert (seen & regions["back-back"]).sum() < 0.02 * (every & regions["back-back"]).sum()
    assert not (seen & ~every).any()
