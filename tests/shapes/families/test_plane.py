"""Aircraft: coordinates mean the same place on every aircraft."""

from __future__ import annotations

import numpy as np
import pytest

from builders.families import Placed, on_slot
from nrdf.shapes.families import Member, get_family

SEEDS = range(30)


PLANE = get_family("plane")


@pytest.fixture(scope="module")
def planes() -> list[Member]:
    return [PLANE.member(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def plane_region(planes: list[Member]) -> Placed:
    return Placed(PLANE, planes)


def has(member: Member, slot: str) -> bool:
    return any(part.slot == slot for part in member.parts)


def test_wing_top_faces_up_and_left_is_left(plane_region: Placed) -> None:
    for side, sign in (("left", -1), ("right", 1)):
        for surface, up in (("top", 1), ("bottom", -1)):
            for points, normals in plane_region(f"{side}-wing-{surface}"):
                assert up * normals[:, 1].mean() > 0.6
                assert (sign * points[:, 2] > -1e-6).all()


def test_a_wing_runs_from_root_to_tip_and_from_leading_to_trailing_edge(
    planes: list[Member],
) -> None:
    v = np.linspace(0.15, 0.95, 9)
    for plane in planes:
        lead, trail = (plane.locate(on_slot(PLANE, "wing-right", u, v)).points for u in (0.0, 0.5))
        assert (lead[:, 0] > trail[:, 0]).all()
        assert (np.diff(lead[:, 2]) > 0).all()
        left = plane.locate(on_slot(PLANE, "wing-left", 0.0, v)).points
        np.testing.assert_allclose(left, lead * [1, 1, -1], atol=1e-9)


def test_the_nose_is_ahead_of_the_wings_and_the_fin_behind_and_above(
    plane_region: Placed,
) -> None:
    wings = plane_region("right-wing-top")
    noses, fins = plane_region("nose"), plane_region("fin")
    tops, bottoms = (plane_region(f"fuselage-{x}") for x in ("top", "bottom"))
    for index in SEEDS:
        wing_x = wings[index][0][:, 0].mean()
        assert noses[index][0][:, 0].mean() > wing_x
        assert tops[index][1][:, 1].mean() > 0.3 > -0.3 > bottoms[index][1][:, 1].mean()
        if len(fins[index][0]):
            assert fins[index][0][:, 0].mean() < wing_x
            assert fins[index][0][:, 1].mean() > noses[index][0][:, 1].mean()


@pytest.mark.parametrize("slot", ["engine-inner-left", "engine-tail-right", "fin", "winglet-left"])
def test_an_absent_slot_does_not_exist(planes: list[Member], slot: str) -> None:
    u, v = np.meshgrid(np.linspace(0, 1, 16), np.linspace(0.05, 0.95, 16))
    coordinates = on_slot(PLANE, slot, u.ravel(), v.ravel())
    with_slot = [has(plane, slot) for plane in planes]
    assert 0 < sum(with_slot) < len(planes)
    for plane, present in zip(planes, with_slot, strict=True):
        assert plane.locate(coordinates).exists.any() == present
