from __future__ import annotations

import numpy as np
import pytest

from nrdf.robot.model.spheres import Spheres, cover_box, cover_capsule, cover_cylinder


@pytest.mark.parametrize(
    ("cover", "inside"),
    [
        (cover_capsule(np.zeros(3), np.array([0.0, 0.0, 0.3]), 0.05), lambda p: p),
        (cover_box(np.array([0.1, 0.05, 0.02])), None),
        (cover_cylinder(0.03, 0.005), None),
        (cover_cylinder(0.03, 0.05), None),
    ],
)
def test_spheres_enclose_the_shape(cover, inside):
    centres, radius = cover
    rng = np.random.default_rng(0)
    low, high = centres.min(0) - radius, centres.max(0) + radius
    points = rng.uniform(low, high, (20000, 3))
    shapes = {
        "capsule": lambda p: (
            np.linalg.norm(p - np.clip(p[:, 2:], 0, 0.3) * [0, 0, 1], axis=1) < 0.05
        ),
        "box": lambda p: (np.abs(p) < [0.1, 0.05, 0.02]).all(axis=1),
        "flat": lambda p: (np.hypot(p[:, 0], p[:, 1]) < 0.03) & (np.abs(p[:, 2]) < 0.005),
        "long": lambda p: (np.hypot(p[:, 0], p[:, 1]) < 0.03) & (np.abs(p[:, 2]) < 0.05),
    }
    name = {0.3: "capsule"}.get(round(float(np.ptp(centres[:, 2])), 3))
    name = name or ("box" if np.ptp(centres[:, 0]) > 0.1 else "flat" if radius < 0.01 else "long")
    points = points[shapes[name](points)]
    away = np.linalg.norm(points[:, None] - centres, axis=2).min(axis=1)
    assert (away <= radius + 1e-9).all()


def test_spheres_go_where_their_links_go():
    spheres = Spheres(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), np.ones(2), np.array([1, 0]))
    about_z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    rotations = np.stack([np.eye(3), about_z])[:, None]
    positions = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, 1.0]])[:, None]
    np.testing.assert_allclose(spheres.at(rotations, positions)[0], [[0, 1, 1], [0, 0, 5]])
    assert len((spheres + Spheres.none()).radii) == 2
