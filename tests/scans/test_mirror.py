"""The mirror plane of an object."""

from __future__ import annotations

import numpy as np
import pytest

from builders.scenes import full
from nrdf.geometry.canonical import rotation_about_up
from nrdf.scans.mirror import mirror_plane

CHAIR = 1_000_003


@pytest.mark.parametrize("start", [-9.0, 0.0, 9.0])
def test_the_mirror_plane_is_found_from_near_it(start):
    surface = full("chair", CHAIR)
    turn, away = rotation_about_up(0.4), np.array([0.2, 0.0, -0.3])
    plane = mirror_plane(
        surface.points @ turn.T + away,
        surface.normals @ turn.T,
        rotation_about_up(0.4 + np.radians(start))[:, 2],
    )
    assert np.degrees(np.arccos(plane.normal @ turn[:, 2])) < 0.5
    assert plane.offset == pytest.approx(away @ turn[:, 2], abs=0.005)
    assert plane.agreement > 0.9


def test_across_no_mirror_plane_little_agrees():
    surface = full("car", CHAIR)
    plane = mirror_plane(surface.points, surface.normals, rotation_about_up(np.radians(45))[:, 2])
    assert plane.agreement < 0.4
