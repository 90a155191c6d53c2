"""More waypoints where the surface bends."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.geometry.polylines import longest_step, step_lengths
from nrdf.toolpath.modifiers import chord_error, largest_step
from nrdf.toolpath.surface_path import SurfacePath

RADIUS = 0.05


def to_cylinder(points, normals):
    out = points * [1.0, 0.0, 1.0]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    return RADIUS * out + points * [0.0, 1.0, 0.0], out, np.ones(len(points), bool)


def around(count: int = 9) -> SurfacePath:
    angles = np.linspace(0.0, np.pi / 2, count)
    out = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    return SurfacePath(RADIUS * out, out)


def sag(path: SurfacePath) -> float:
    middles = 0.5 * (path.contacts[1:] + path.contacts[:-1])
    return float((RADIUS - np.linalg.norm(middles, axis=1)).max())


@pytest.mark.parametrize("largest", [2e-4, 2e-5])
def test_the_straight_way_keeps_to_the_surface(largest):
    given = around()
    assert sag(given) > 2e-4
    (made,) = chord_error([given], to_cylinder, largest)
    assert sag(made) <= largest
    assert np.linalg.norm(made.contacts, axis=1) == pytest.approx(RADIUS)
    assert made.normals == pytest.approx(made.contacts / RADIUS)
    assert all((np.abs(made.contacts - c).max(axis=1) < 1e-12).any() for c in given.contacts)
    # No more than asked for: half as many would be too few.
    assert sag(SurfacePath(made.contacts[::2], made.normals[::2])) > largest


def test_where_the_surface_is_flat_nothing_is_added():
    flat = SurfacePath(
        np.stack([0.0 * np.arange(5), 0.01 * np.arange(5), np.full(5, RADIUS)], axis=1),
        np.tile([0.0, 0.0, 1.0], (5, 1)),
    )
    assert len(chord_error([flat], to_cylinder, 1e-6)[0].contacts) == 5
    assert chord_error([around()], to_cylinder, 0.0)[0].contacts.shape == (9, 3)


def test_a_place_off_the_surface_is_not_taken():
    def nowhere(points, normals):
        return points + 1.0, normals, np.ones(len(points), bool)

    (made,) = chord_error([around()], nowhere, 1e-5)
    assert longest_step(made.contacts) == longest_step(around().contacts)


def test_a_tool_that_stands_off_makes_no_long_steps_around_a_bend():
    angle = np.linspace(0.0, 1.5, 16)  # steps of 5 mm on a roller of 50 mm
    out = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)

    def project(points, normals):
        around = points / np.linalg.norm(points, axis=1, keepdims=True)
        return 0.05 * around, around, np.ones(len(points), bool)

    path = SurfacePath(0.05 * out, out)
    (made,) = largest_step([path], project, 0.2, 0.02)
    tips = made.contacts + 0.2 * made.normals
    assert step_lengths(path.contacts + 0.2 * path.normals).max() > 0.02
    assert step_lengths(tips).max() <= 0.02
    assert np.linalg.norm(made.contacts, axis=1) == pytest.approx(0.05)
    assert largest_step([path], project, 0.0, 0.02)[0] is path
    # What runs off stays straight.
    ahead = path.contacts[-1] + np.outer([0.005, 0.01], [np.cos(1.5), 0.0, -np.sin(1.5)])
    longer = SurfacePath(np.concatenate([path.contacts, ahead]), np.concatenate([out, out[-2:]]))
    (made,) = largest_step([longer], project, 0.2, 0.004)
    assert np.linalg.norm(made.contacts[-1] - ahead[-1]) == 0.0
    assert np.linalg.norm(made.contacts, axis=1)[-3:].min() > 0.0502
