"""Members of every family: exact occupancy, outward normals, exact correspondence."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from builders.families import flips
from nrdf.errors import DataError
from nrdf.shapes.families import FAMILY_NAMES, Family, Member, SurfaceCoordinates, get_family
from nrdf.shapes.families.base import (
    CAP_START,
    CAP_STOP,
    SIDE,
    WALL,
    Part,
    Window,
)
from nrdf.shapes.families.sections import Superellipse

SEEDS = range(12)


@pytest.fixture(scope="module", params=FAMILY_NAMES)
def family(request: pytest.FixtureRequest) -> Family:
    return get_family(request.param)


@pytest.fixture(scope="module")
def members(family: Family) -> list[Member]:
    return [family.member(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def coordinates(family: Family) -> SurfaceCoordinates:
    return family.canonical_coordinates(3000, np.random.default_rng(0), members=25)


def test_an_unknown_family_is_refused_with_the_known_names() -> None:
    with pytest.raises(DataError, match="no family 'boat'; known: chair, car, plane, table"):
        get_family("boat")


def test_a_seed_fixes_the_member(family: Family) -> None:
    first, again = family.member(7), family.member(7)
    one = first.sample_surface(300, np.random.default_rng(0))
    two = again.sample_surface(300, np.random.default_rng(0))
    np.testing.assert_array_equal(one.points, two.points)
    np.testing.assert_array_equal(one.coordinates.slot, two.coordinates.slot)


def test_seeds_give_distinct_members(family: Family) -> None:
    queries = np.random.default_rng(0).uniform(-0.5, 0.5, (1500, 3))
    bits = {family.member(seed).occupancy(queries).tobytes() for seed in range(30)}
    assert len(bits) == 30


def test_members_are_canonical(members: list[Member]) -> None:
    for member in members:
        points = member.sample_surface(8000, np.random.default_rng(0)).points
        assert np.abs(points).max() <= 0.5 + 1e-4
        low, high = points.min(0), points.max(0)
        assert (high - low).max() > 0.97  # pointed ends are seldom hit by a sample
        outside = np.random.default_rng(1).uniform(-0.7, 0.7, (4000, 3))
        outside = outside[np.abs(outside).max(1) > 0.5 + 1e-4]
        assert not member.occupancy(outside).any()


def test_surface_parts_inside_from_outside_and_normals_point_out(members: list[Member]) -> None:
    for member in members:
        sample = member.sample_surface(2048, np.random.default_rng(0))
        np.testing.assert_allclose(np.linalg.norm(sample.normals, axis=1), 1, atol=1e-6)
        assert flips(member, sample.points, sample.normals) >= 0.995


def test_locating_its_own_coordinates_returns_its_own_points(members: list[Member]) -> None:
    for member in members:
        sample = member.sample_surface(1000, np.random.default_rng(0))
        order = np.random.default_rng(1).permutation(1000)
        located = member.locate(sample.coordinates[order])
        assert located.exists.all()
        np.testing.assert_allclose(located.points, sample.points[order], atol=1e-12)
        np.testing.assert_allclose(located.normals, sample.normals[order], atol=1e-6)


def test_locating_on_another_member_lands_on_its_surface(members: list[Member]) -> None:
    shares = []
    for one, other in pairwise(members):
        sample = one.sample_surface(2048, np.random.default_rng(0))
        located = other.locate(sample.coordinates)
        points, normals = located.points[located.exists], located.normals[located.exists]
        shares.append(located.exists.mean())
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
        assert flips(other, points, normals) >= 0.995
        there_and_back = one.locate(sample.coordinates[located.exists])
        np.testing.assert_allclose(there_and_back.points, sample.points[located.exists], atol=1e-12)
    assert np.mean(shares) > 0.4


def test_correspondence_keeps_left_and_right(family: Family, members: list[Member]) -> None:
    side = np.array([("right" in s) - ("left" in s) for s in family.slots])
    assert (side != 0).any()
    for member in members:
        sample = member.sample_surface(2048, np.random.default_rng(0))
        sign = side[sample.coordinates.slot]
        assert (sample.points[:, 2] * sign < -0.05).mean() < 0.01


def test_a_slot_that_a_member_lacks_does_not_exist(family: Family) -> None:
    members = [family.member(seed) for seed in range(40)]
    having = {s: [m for m in members if s in {p.slot for p in m.parts}] for s in family.slots}
    partial = [s for s in family.slots if 0 < len(having[s]) < len(members)]
    assert partial, "every member has every slot: the topology does not vary"
    for name in partial[:8]:
        index = family.slot(name)
        donor = having[name][0].sample_surface(3000, np.random.default_rng(0)).coordinates
        mine = donor[np.flatnonzero(donor.slot == index)]
        lacking = next(m for m in members if m not in having[name])
        located = lacking.locate(mine)
        assert not located.exists.any()
        assert not located.points.any()


def test_the_canonical_list_covers_every_slot_that_occurs(
    family: Family, members: list[Member], coordinates: SurfaceCoordinates
) -> None:
    assert len(coordinates) == 3000
    listed = {family.slots[i] for i in np.unique(coordinates.slot)}
    assert {part.slot for member in members for part in member.parts} <= listed
    shares = [member.locate(coordinates).exists.mean() for member in members]
    assert 0.15 < np.mean(shares) < 1


def test_a_generator_fixes_the_canonical_list(
    family: Family, coordinates: SurfaceCoordinates
) -> None:
    again = family.canonical_coordinates(3000, np.random.default_rng(0), members=25)
    np.testing.assert_array_equal(again.u, coordinates.u)
    np.testing.assert_array_equal(again.slot, coordinates.slot)


def test_regions_are_named_and_found(family: Family, coordinates: SurfaceCoordinates) -> None:
    names = family.region_of(coordinates)
    assert set(np.unique(names)) - {""} <= set(family.region_names)
    for name in family.region_names:
        mask = family.region(name, coordinates)
        np.testing.assert_array_equal(mask, names == name)
        assert mask.any(), name
    with pytest.raises(ValueError, match="no region 'lid' in family"):
        family.region("lid", coordinates)


def test_a_slat_corresponds_to_the_solid_back_at_the_same_place() -> None:
    outline = Superellipse(0.2, 0.02, 20.0)
    solid = Part("back", 1, 0.0, 1.0, outline)
    windows = tuple(Window(x, 0.5, 0.2, 0.3, key=i) for i, x in enumerate((-0.5, 0.5)))
    slatted = Part("back", 1, 0.0, 1.0, outline, windows=windows)
    one, two = (Member(("back",), [part]) for part in (solid, slatted))
    sample = two.sample_surface(4000, np.random.default_rng(0))
    on_solid = one.locate(sample.coordinates)
    wall = sample.coordinates.face >= WALL
    assert wall.sum() > 100
    np.testing.assert_array_equal(on_solid.exists, ~wall)
    np.testing.assert_allclose(on_solid.points[~wall], sample.points[~wall], atol=1e-12)
    sample = one.sample_surface(4000, np.random.default_rng(0))
    gap = (np.abs(np.abs(sample.points[:, 2]) - 0.1) < 0.04) & (np.abs(sample.points[:, 1]) < 0.3)
    np.testing.assert_array_equal(two.locate(sample.coordinates).exists, ~gap)


def test_a_buried_place_does_not_exist() -> None:
    box = Superellipse(0.5, 0.5, np.float64(400.0))
    lower = Part("lower", 1, 0.0, 1.0, box)
    upper = Part("upper", 1, 1.0, 2.0, Superellipse(0.25, 0.25, 400.0))
    member = Member(("lower", "upper"), [lower, upper])
    ones = np.full(50, 0.5)
    u = np.linspace(0.01, 0.99, 50)
    bottom = SurfaceCoordinates(np.ones(50, np.int32), np.full(50, CAP_START, np.int32), u, ones)
    assert not member.locate(bottom).exists.any()
    top = SurfaceCoordinates(np.zeros(50, np.int32), np.full(50, CAP_STOP, np.int32), u, ones * 0.5)
    assert not member.locate(top).exists.any()
    rim = SurfaceCoordinates(top.slot, top.face, u, np.full(50, 0.9))
    assert member.locate(rim).exists.all()


def test_samples_are_even_by_area() -> None:
    """A cylinder: the share of samples on side and caps, and radially within a cap."""
    part = Part("a", 1, 0.0, 1.0, Superellipse(0.5, 0.5))
    sample = Member(("a",), [part]).sample_surface(40_000, np.random.default_rng(0))
    face, v = sample.coordinates.face, sample.coordinates.v
    assert (face == SIDE).mean() == pytest.approx(2 / 3, abs=0.01)
    assert (v[face != SIDE] < 0.5).mean() == pytest.approx(0.25, abs=0.015)
    assert (v[face == SIDE] < 0.3).mean() == pytest.approx(0.3, abs=0.012)
