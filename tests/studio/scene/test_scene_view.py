"""Objects in the scene: side by side, seen by the camera, met by rays."""

from __future__ import annotations

import numpy as np
import pytest

from builders.taught_box import SIZE, cloud
from nrdf.studio.model.paintable_cloud import PaintableCloud


@pytest.fixture
def row(scene_view):
    """Three boxes in a row."""
    for number, key in enumerate(("reference", "first", "second")):
        scene_view.add(key, PaintableCloud(cloud(SIZE, 600, number)))
    return scene_view


def test_only_what_is_shown_stands_in_the_row(row):
    row.arrange(["reference", "second"])
    visible = {key: view.frame.visible for key, view in row.objects.items()}
    assert visible == {"reference": True, "first": False, "second": True}
    reference, second = (row.objects[key].corners for key in ("reference", "second"))
    assert second[:, 2].max() < reference[:, 2].min(), "to the right, seen from the front"
    assert reference[:, 1].min() == pytest.approx(0.0, abs=1e-9), "on the floor"


def test_the_camera_sees_every_corner(row):
    from nrdf.studio.scene.camera import Camera
    from nrdf.studio.scene.scene_view import FOV_RAD

    shown = list(row.objects)
    row.arrange(shown)
    for aspect, free in ((0.6, (0, 0, 1, 1)), (2.0, (0, 0, 1, 1)), (1.4, (0.1, 0.2, 0.8, 0.95))):
        position, look_at = row.camera(shown, aspect, free=free)
        forward = (look_at - position) / np.linalg.norm(look_at - position)
        right = np.cross(forward, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, -np.cross(right, forward), forward], axis=1)
        camera = Camera(position, rotation, FOV_RAD, aspect)
        corners = np.concatenate([view.corners for view in row.objects.values()])
        places, depths = camera.project(corners)
        assert (depths > 0).all()
        assert (places > free[:2]).all() and (places < free[2:]).all()
        assert (np.ptp(places, axis=0) / np.subtract(free[2:], free[:2])).max() > 0.85, "large"


def test_a_ray_meets_the_nearest_visible_object(row):
    row.arrange(list(row.objects))
    first = row.objects["first"]
    middle = first.corners.mean(axis=0) * [1.0, 0.0, 1.0] + [0.0, 0.2, 0.0]
    ray = middle + np.array([9.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    hit = row.hit(*ray)
    assert hit is not None and hit[0] is first
    assert first.paintable.normals[hit[1]][0] > 0.9, "its front"
    first.frame.visible = False
    assert row.hit(*ray) is None
