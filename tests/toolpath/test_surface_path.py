"""Paths on a surface, turned round and cut."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.toolpath.surface_path import SurfacePath


def straight(count=5):
    x = np.linspace(0.0, 1.0, count)
    contacts = np.stack([x, 0 * x, 0 * x], axis=1)
    return SurfacePath(contacts, np.tile([0.0, 0.0, 1.0], (count, 1)))


def square():
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]], float)
    return SurfacePath(corners, np.tile([0.0, 0.0, 1.0], (5, 1)), True)


def test_a_path_has_its_length_and_can_be_driven_backwards():
    assert straight().length_m == pytest.approx(1.0) and square().length_m == pytest.approx(4.0)
    np.testing.assert_array_equal(straight().reversed().contacts, straight().contacts[::-1])
    assert square().reversed().closed


def test_a_part_is_open():
    part = square().part(np.array([1, 2, 3]))
    assert part.length_m == pytest.approx(2.0) and not part.closed


def test_a_loop_may_begin_anywhere():
    turned = square().from_contact(2)
    assert turned.closed and turned.length_m == pytest.approx(4.0)
    np.testing.assert_array_equal(turned.contacts[[0, -1]], [[1, 1, 0], [1, 1, 0]])
    np.testing.assert_array_equal(straight().from_contact(2).contacts, straight().contacts)
