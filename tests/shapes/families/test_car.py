"""Cars: coordinates mean the same place on every car."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from builders.families import Placed, on_slot
from nrdf.shapes.families import Member, get_family
from nrdf.shapes.families.bodywork import TOP_V

SEEDS = range(30)


CAR = get_family("car")


@pytest.fixture(scope="module")
def cars() -> list[Member]:
    return [CAR.member(seed) for seed in SEEDS]


@pytest.fixture(scope="module")
def car_region(cars: list[Member]) -> Placed:
    return Placed(CAR, cars)


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
