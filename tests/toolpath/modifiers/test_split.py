"""Splitting at steps and turns."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import over_an_edge, straight
from nrdf.geometry.polylines import longest_step
from nrdf.toolpath.modifiers import MODIFIERS
from nrdf.toolpath.modifiers.split import split, turns
from nrdf.toolpath.surface_path import SurfacePath


def test_a_path_ends_at_every_step_that_is_too_large():
    path = straight((0, 0, 0), (0.2, 0, 0))
    kept = np.delete(np.arange(21), [5, 6, 12, 13, 15, 16])  # leaves point 14 alone
    parts = split([SurfacePath(path.contacts[kept], path.normals[kept])], 0.02)
    assert [len(part.contacts) for part in parts] == [5, 5, 4]
    assert all(longest_step(part.contacts) <= 0.02 for part in parts)
    assert split([path], 0.02)[0].contacts.tolist() == path.contacts.tolist()


def test_a_path_ends_at_every_turn_that_is_too_sharp():
    sharp = over_an_edge(1.0)
    assert len(split([sharp], 0.02)) == 1
    assert [len(part.contacts) for part in split([sharp], 0.02, 50.0)] == [11, 10]
    assert len(split([sharp], 0.02, 150.0)) == 1


def test_turns_are_angles():
    angles = np.array([0.0, 1e-7, 0.5, np.pi])
    directions = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    assert turns(directions) == pytest.approx(np.diff(angles), rel=1e-6)
    assert MODIFIERS["split"] is split
