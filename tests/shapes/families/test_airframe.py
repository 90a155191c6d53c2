"""What aircraft are made of."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.airframe import Surface, both, propeller, wheel
from nrdf.shapes.families.base import SIDE


def test_a_surface_knows_its_edge_and_chord() -> None:
    wing = Surface(2.0, 1.0, 0.5, np.pi / 4, (0.1, 0.1), dihedral=0.1, kink=(0.5, 0.6))
    x, y, z, chord = wing.at(0.5)
    assert (x, z, chord) == pytest.approx((-1.0, 1.0, 0.6))
    assert y == pytest.approx(np.tan(0.1))


def test_blades_of_a_propeller_stand_around_its_hub() -> None:
    hub = (0.4, 0.1, -0.2)
    blades = propeller("nose", hub, 0.3, (3, 0.2, 0.02))
    assert [blade.slot for blade in blades] == [f"propeller-nose-{k}" for k in (1, 2, 3)]
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9)))
    middles = np.array([b.points(np.full(len(u), SIDE), u, v).mean(axis=0) - hub for b in blades])
    away = np.linalg.norm(middles, axis=1)
    np.testing.assert_allclose(away, away[0])
    np.testing.assert_allclose(middles.sum(axis=0)[1:], 0.0, atol=1e-9)


def test_both_sides_are_mirror_images() -> None:
    right = wheel("gear-wheel-right", (0.1, -0.2, 0.3), 0.05, 0.02)
    one, other = both(right)
    assert (one.slot, other.slot) == ("gear-wheel-right", "gear-wheel-left")
    u, v = np.linspace(0, 1, 9), np.full(9, 0.5)
    there = other.points(np.full(9, SIDE), u, v)
    np.testing.assert_allclose(there, one.points(np.full(9, SIDE), u, v) * [1, 1, -1])
