from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import board, tube
from nrdf.surface.patch import patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.surface_path import (
    SurfacePath,
    find_contacts,
    order_nearest_first,
    place_on_surface,
)


def straight(first, last, count=5):
    contacts = np.linspace(first, last, count)
    return SurfacePath(contacts, np.tile([0.0, 0.0, 1.0], (count, 1)))


def test_a_planar_path_is_placed_with_even_contacts():
    surface = Surface(*tube(radius=0.1, turn=2.0))
    (patch,) = patches_of(surface, np.arange(len(surface.points)))
    reach = 0.4 * np.ptp(patch.uv, axis=0)
    planar = np.stack([-reach, reach])
    ((path,),) = place_on_surface(surface, patch, [[planar]], 0.01, 0.02)
    steps = np.linalg.norm(np.diff(path.contacts, axis=0), axis=1)
    assert steps == pytest.approx(0.01, rel=0.1)
    radius = np.linalg.norm(path.contacts[:, :2], axis=1)
    np.testing.assert_allclose(radius, 0.1, atol=1e-3)
    assert place_on_surface(surface, patch, [[]], 0.01, 0.02) == []


def test_a_point_beyond_the_surface_has_no_contact():
    surface = Surface(*board())
    places = np.array([[0.2, 0.15, 0.002], [0.8, 0.15, 0.0]])
    contacts, normals, there = find_contacts(
        surface, places, np.tile([0.0, 0.0, 1.0], (2, 1)), 0.01, 0.02
    )
    assert there.tolist() == [True, False]
    np.testing.assert_allclose(contacts[0], [0.2, 0.15, 0.0], atol=1e-6)
    np.testing.assert_allclose(normals[0], [0.0, 0.0, 1.0], atol=1e-6)


def test_blocks_follow_each_other_by_the_shortest_moves():
    near = [straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])]
    far = [straight([5.0, 0.0, 0.0], [6.0, 0.0, 0.0])]
    turned = [straight([3.0, 0.0, 0.0], [1.1, 0.0, 0.0])]
    ordered = order_nearest_first([near, far, turned])
    assert [block[0].contacts[0, 0] for block in ordered] == [0.0, 1.1, 5.0]
    np.testing.assert_array_equal(ordered[1][0].contacts, turned[0].contacts[::-1])
