"""Aircraft: airliners, business and military jets, propeller aircraft, gliders.

Unit: the fuselage's length. Fuselage coordinates run from tail over fin, wing root and cockpit to
the nose; those of lifting surfaces along chord and span, upper and lower side apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.aircraft import Aircraft
from nrdf.shapes.families.airframe import FUSELAGE_TOP_V
from nrdf.shapes.families.base import CAP_STOP, SIDE, Part, SurfaceCoordinates
from nrdf.shapes.families.member import Family
from nrdf.shapes.families.plane_styles import random_style

_SIDES = ("left", "right")
_PROPELLERS = ("nose", *(f"{p}-{side}" for p in ("inner", "outer") for side in _SIDES))


def _pair(*names: str) -> tuple[str, ...]:
    return tuple(f"{name}-{side}" for name in names for side in _SIDES)


class PlaneFamily(Family):
    """Airliners, business jets, turboprops, light aircraft, fighters, bombers and gliders."""

    name = "plane"
    slots = (
        "fuselage", "canopy", "belly",
        *_pair("wing", "winglet", "tip-tank", "strut", "canard"),
        *_pair("tail-plane"), "fin", *_pair("fin"),
        *_pair("engine-inner", "engine-outer", "engine-tail"), "engine-centre",
        *_pair("pylon-inner", "pylon-outer", "pylon-tail"),
        *_pair("intake", "nozzle"), "spinner",
        *(f"propeller-{place}-{k}" for place in _PROPELLERS for k in (1, 2, 3, 4)),
        *_pair("gear-leg", "gear-wheel"), "gear-leg-nose", "gear-wheel-nose",
    )  # fmt: skip
    region_names = (
        "nose", "fuselage-top", "fuselage-bottom",
        "left-wing-top", "left-wing-bottom", "right-wing-top", "right-wing-bottom",
        "tail-plane", "fin", "engines",
    )  # fmt: skip

    def build(self, rng: np.random.Generator) -> list[Part]:
        return Aircraft(random_style(rng), rng).parts

    def region_of(self, coordinates: SurfaceCoordinates) -> NDArray[np.str_]:
        out = np.full(len(coordinates), "", dtype="<U17")
        slot, face, v = coordinates.slot, coordinates.face, coordinates.v
        u = coordinates.u - np.floor(coordinates.u)
        fuselage = slot == self.slot("fuselage")
        out[fuselage] = np.where(
            np.abs(u[fuselage] - 0.5) > 0.25, "fuselage-top", "fuselage-bottom"
        )
        ahead = np.where(face == SIDE, v > FUSELAGE_TOP_V[4], face == CAP_STOP)
        out[fuselage & ahead] = "nose"
        for side in _SIDES:
            wing = slot == self.slot(f"wing-{side}")
            out[wing] = np.where(u[wing] < 0.5, f"{side}-wing-top", f"{side}-wing-bottom")
        for region, start in (("tail-plane", "tail-plane"), ("fin", "fin"), ("engines", "engine")):
            indices = [i for i, name in enumerate(self.slots) if name.startswith(start)]
            out[np.isin(slot, indices)] = region
        return out


FAMILY = PlaneFamily()
