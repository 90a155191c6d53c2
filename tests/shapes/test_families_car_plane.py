"""Cars and aircraft: coordinates mean the same place on every member."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from nrdf.shapes.families import Family, Member, SurfaceCoordinates, get_family
from nrdf.shapes.families.airframe import Surface
from nrdf.shapes.families.base import SIDE
from nrdf.shapes.families.bodywork import TOP_V, filleted, ramp
from nrdf.shapes.families.vehicle import semantic_station

SEEDS = range(30)
CAR, PLANE = get_family("car"), get_family("plane")


@pytest.fixture(scope="module")
def cars() -> list[Member]:
    return [CAR.member(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def planes() -> list[Member]:
    return [PLANE.member(seed) for seed in SEEDS]


def on_slot(family: Family, slot: str, u: object, v: object) -> SurfaceCoordinates:
    """Coordinates on the SIDE face of a slot."""
    u, v = np.broadcast_arrays(np.atleast_1d(np.asarray(u, float)), np.asarray(v, float))
    number = np.full(u.shape, family.slot(slot), np.int32)
    return SurfaceCoordinates(number, np.full(u.shape, SIDE, np.int32), u.copy(), v.copy())


class Placed:
    """One list of coordinates, found on every member."""

    def __init__(self, family: Family, members: list[Member]) -> None:
        self.family = family
        self.coordinates = family.canonical_coordinates(3000, np.random.default_rng(0), members=30)
        self.found = [member.locate(self.coordinates) for member in members]

    def __call__(self, name: str) -> list[tuple[np.ndarray, np.ndarray]]:
        """Points and normals of one region, a pair for each member."""
        mask = self.family.region(name, self.coordinates)
        return [(f.points[f.exists & mask], f.normals[f.exists & mask]) for f in self.found]


@pytest.fixture(scope="module")
def car_region(cars: list[Member]) -> Placed:
    return Placed(CAR, cars)


@pytest.fixture(scope="module")
def plane_region(planes: list[Member]) -> Placed:
    return Placed(PLANE, planes)


def has(member: Member, slot: str) -> bool:
    return any(part.slot == slot for part in member.parts)


def test_the_bonnet_lies_ahead_of_the_windscreen_on_every_car(car_region: Placed) -> None:
    order = ("boot", "rear-window", "roof", "windscreen", "bonnet")
    regions = [car_region(name) for name in order]
    for member in SEEDS:
        means = [r[member][0][:, 0].mean() for r in regions if len(r[member][0])]
        assert (np.diff(means) > 0).all()
    bonnet, screen = regions[4], regions[3]
    for (front, _), (back, _) in zip(bonnet, screen, strict=True):
        middle = np.abs(front[:, 2]) < 0.05, np.abs(back[:, 2]) < 0.05
        assert front[middle[0], 0].min() > back[middle[1], 0].max() - 1e-3


def test_a_windscreen_is_steeper_than_bonnet_and_roof(cars: list[Member]) -> None:
    """v = TOP_V[5] is the windscreen's base on every car, however long its bonnet is."""
    v = np.concatenate([np.linspace(a + 0.02, b - 0.02, 9) for a, b in pairwise(TOP_V[3:7])])
    for car in cars:
        normals = car.locate(on_slot(CAR, "body", 0.0, v)).normals
        roof, screen, bonnet = np.median(normals[:, 1].reshape(3, 9), axis=1)
        assert screen < roof and screen < bonnet


def test_car_regions_face_where_their_names_say(car_region: Placed) -> None:
    facing = {
        "roof": (1, 1), "windscreen": (1, 1), "bonnet": (1, 1), "underside": (1, -1),
        "left-side": (2, -1), "right-side": (2, 1), "front-end": (0, 1), "rear-end": (0, -1),
    }  # fmt: skip
    for name, (axis, sign) in facing.items():
        for points, normals in car_region(name):
            assert sign * normals[:, axis].mean() > 0.3, name
            assert sign * np.median(points[:, axis]) > 0, name


def test_cars_have_a_cars_proportions_and_stand_on_four_wheels(cars: list[Member]) -> None:
    for car in cars:
        points = car.sample_surface(1500, np.random.default_rng(0)).points
        length, height, width = np.ptp(points, axis=0)
        assert length > 0.97 and 0.2 < height < 0.62 and 0.32 < width < 0.7
        feet = []
        for end in ("front", "rear"):
            for side in ("left", "right"):
                rim = on_slot(CAR, f"wheel-{end}-{side}", np.linspace(0, 1, 64), 0.6)
                feet.append(car.locate(rim).points.min(0))
        np.testing.assert_allclose(np.array(feet)[:, 1], points[:, 1].min(), atol=0.012)


def test_wheels_sit_at_their_arches_and_corners(cars: list[Member]) -> None:
    for car in cars:
        hub = {
            (end, side): car.locate(
                on_slot(CAR, f"wheel-{end}-{side}", np.linspace(0, 1, 32, endpoint=False), 0.9)
            ).points.mean(0)
            for end in ("front", "rear")
            for side in ("left", "right")
        }
        assert hub["front", "left"][0] > 0.1 > -0.1 > hub["rear", "left"][0]
        for end in ("front", "rear"):
            left, right = hub[end, "left"], hub[end, "right"]
            np.testing.assert_allclose(left, right * [1, 1, -1], atol=1e-9)
            assert right[2] > 0.1


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


def test_aircraft_have_the_spread_of_real_ones() -> None:
    spans = []
    for seed in range(60):
        parts = {p.slot: p for p in PLANE.member(seed).parts}
        u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 8)))
        side = np.full(len(u), SIDE)
        length = np.ptp(parts["fuselage"].points(side, u, v)[:, 0])
        spans.append(2 * parts["wing-right"].points(side, u, v)[:, 2].max() / length)
    assert min(spans) > 0.35 and max(spans) < 2.8
    assert np.percentile(spans, 15) < 0.75 and np.percentile(spans, 85) > 1.05


@pytest.mark.parametrize("family", [CAR, PLANE], ids=lambda f: f.name)
def test_stations_rise_from_end_to_end_on_hundreds_of_members(family: Family) -> None:
    u, v = np.meshgrid(np.linspace(0, 1, 17), np.linspace(0, 1, 60))
    for seed in range(200):
        body = family.build(np.random.default_rng(seed))
        station = next(p.station for p in body if p.slot in ("body", "fuselage"))
        assert station is not None
        s = station(u.ravel(), v.ravel()).reshape(u.shape)
        assert (np.diff(s, axis=0) > 0).all()
        np.testing.assert_allclose(s[[0, -1]], np.array([[0.0], [1.0]]) + 0 * s[:2], atol=1e-12)


def test_semantic_stations_pass_through_the_knots() -> None:
    station = semantic_station(
        ([0, 0.3, 0.6, 1], [0, 0.1, 0.8, 1]), ([0, 0.5, 1], [0, 0.2, 1]), (0.1, 0.2)
    )
    np.testing.assert_allclose(station(np.zeros(4), np.array([0, 0.3, 0.6, 1])), [0, 0.1, 0.8, 1])
    np.testing.assert_allclose(station(np.full(3, 0.7), np.array([0, 0.5, 1])), [0, 0.2, 1])


def test_fillets_round_corners_only() -> None:
    curve = filleted([0, 1, 2], [0, 1, 0], [0.2])
    np.testing.assert_allclose(curve(np.array([0.0, 0.5, 0.8, 1.2, 2.0])), [0, 0.5, 0.8, 0.8, 0])
    assert curve(np.array([1.0]))[0] == pytest.approx(0.9)
    np.testing.assert_allclose(ramp(np.array([-1.0, 0.0, 1.0]), 0.4), [0, 0.1, 1])


def test_a_surface_knows_its_edge_and_chord() -> None:
    wing = Surface(2.0, 1.0, 0.5, np.pi / 4, (0.1, 0.1), dihedral=0.1, kink=(0.5, 0.6))
    x, y, z, chord = wing.at(0.5)
    assert (x, z, chord) == pytest.approx((-1.0, 1.0, 0.6))
    assert y == pytest.approx(np.tan(0.1))
