"""Parts and the maps that bend them, which invert exactly."""

from __future__ import annotations

import numpy as np
import pytest

from builders.families import flips
from nrdf.shapes.families import Member
from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SIDE,
    WALL,
    Affine,
    Part,
    Warp,
    Window,
    rotation,
)
from nrdf.shapes.families.sections import Airfoil, Superellipse, linear, rounded, smooth

MAPS = (
    Warp(0, offset=lambda y, z: 0.2 * np.sin(3 * y) + z**2, scale=lambda y, z: 1.3 + 0.2 * y),
    rotation(2, 0.7, pivot=(0.1, 0.2, 0.0)),
    Warp(2, scale=lambda x, y: 1 + 0.3 * x, anchor=0.1),
    Affine(np.diag([1.0, 1.0, -1.0])),
)


def test_maps_invert_exactly() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3))
    for step in MAPS:
        np.testing.assert_allclose(step.inverse(step.forward(points)), points, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    "section",
    [
        Superellipse(0.4, smooth([0, 0.5, 1], [0.1, 0.2, 0.1]), 2.0),
        Superellipse(rounded(0.3, 0.3, 0.5), 0.2, 5.0, b_low=0.1, e_low=2.0),
        Airfoil(linear([0, 1], [0.5, 0.3]), thickness=0.15, camber=0.03),
    ],
    ids=["ellipse", "egg", "airfoil"],
)
def test_a_warped_and_mirrored_part_keeps_its_skin(axis: int, section: Superellipse) -> None:
    windows = (Window(0.1, 0.5, 0.3, 0.2, 3.0),)
    bend = linear([0, 1], [0.0, 0.3]), 0.1
    part = Part("a", axis, -0.5, 0.5, section, bend, windows).mapped(*MAPS)
    member = Member(("a",), [part])
    sample = member.sample_surface(3000, np.random.default_rng(0))
    assert set(np.unique(sample.coordinates.face)) == {SIDE, CAP_START, CAP_STOP, WALL} or (
        section.half_width(np.zeros(1)) == 0
    )
    assert flips(member, sample.points, sample.normals) >= 0.995


def test_a_part_in_the_wrong_direction_or_twice_in_a_slot_is_refused() -> None:
    with pytest.raises(ValueError, match="must exceed start"):
        Part("a", 0, 1.0, 0.0, Superellipse(1.0, 1.0))
    part = Part("a", 0, 0.0, 1.0, Superellipse(1.0, 1.0))
    with pytest.raises(ValueError, match="distinct slots"):
        Member(("a",), [part, part])
