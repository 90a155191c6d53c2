"""Aircraft as they are put together."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families import get_family
from nrdf.shapes.families.aircraft import Aircraft
from nrdf.shapes.families.base import SIDE
from nrdf.shapes.families.plane_styles import random_style

PLANE = get_family("plane")


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


def test_parts_of_an_aircraft_are_mirrored_and_its_wing_leaves_the_fuselage() -> None:
    for seed in range(8):
        rng = np.random.default_rng(seed)
        parts = {part.slot: part for part in Aircraft(random_style(rng), rng).parts}
        for slot in parts:
            if slot.endswith("-right"):
                assert slot.replace("-right", "-left") in parts
        u, v = np.linspace(0, 1, 20), np.zeros(20)
        root = parts["wing-right"].points(np.full(20, SIDE), u, v)
        assert np.abs(root[:, 2]).max() < 0.1  # near the plane of symmetry
