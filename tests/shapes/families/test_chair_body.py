"""Seats and backs of chairs."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.base import SIDE
from nrdf.shapes.families.chair_body import random_back, random_seat
from nrdf.shapes.families.chair_styles import STYLES


@pytest.mark.parametrize("kind", STYLES)
def test_a_back_rises_from_the_rear_of_its_seat(kind: str) -> None:
    style = STYLES[kind]
    for seed in range(10):
        rng = np.random.default_rng(seed)
        seat = random_seat(rng, style, kind, plinth=False, boxy=False)
        assert style.seat_height[0] <= seat.top <= style.seat_height[1]
        back = random_back(rng, style, kind, seat)
        x, z, _ = back.edge(back.bottom + 0.5 * back.height)
        assert x < 0.5 * seat.half_depth
        assert 0 < z < 2 * seat.half_width
        assert back.bottom + back.height > seat.top


def test_a_seat_on_a_plinth_reaches_the_floor() -> None:
    seat = random_seat(np.random.default_rng(0), STYLES["upholstered"], "upholstered", True, False)
    assert 0 <= seat.top - seat.thickness <= 0.04
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9)))
    assert seat.part.points(np.full(len(u), SIDE), u, v)[:, 1].min() < 0.05
