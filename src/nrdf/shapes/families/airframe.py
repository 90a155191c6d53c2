"""What aircraft are made of: fuselages, lifting surfaces, engines, propellers, undercarriage.

Unit: the fuselage's length. x = 0 is its tail, x = 1 its nose; y = 0 its axis; +z is right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.shapes.families.base import Affine, Part, rotation
from nrdf.shapes.families.furniture import bar
from nrdf.shapes.families.plane_styles import Style
from nrdf.shapes.families.sections import (
    Airfoil,
    Array,
    Superellipse,
    linear,
    rounded,
    smooth,
)
from nrdf.shapes.families.vehicle import blob, dish, semantic_station

FUSELAGE_TOP_V = (0.0, 0.06, 0.22, 0.80, 0.92, 1.0)
"""v on top of: tail, fin's trailing and leading edge, cockpit's rear and front, nose."""

FUSELAGE_SIDE_V = (0.0, 0.34, 0.60, 0.80, 0.92, 1.0)
"""v on the sides of: tail, wing root's trailing and leading edge, cockpit, nose."""

ROOT_V = 0.1
"""v of a lifting surface where it leaves the fuselage."""

# Stations behind the nose, then in radii: half-height, axis height, half-width.
_PROFILES = {
    "nose-prop": (
        [0.0, 0.13, 0.22, 0.30, 0.44, 0.60, 1.0],
        [0.56, 0.66, 0.70, 1.0, 1.0, 0.66, 0.14],
        [-0.12, -0.14, -0.14, 0.12, 0.12, 0.08, 0.22],
        [0.62, 0.85, 0.92, 1.0, 1.0, 0.66, 0.12],
    ),
    "cabin": (
        [0.0, 0.20, 0.30, 0.50, 0.66, 1.0],
        [0.72, 0.76, 1.0, 1.0, 0.72, 0.16],
        [-0.25, -0.12, 0.06, 0.06, 0.05, 0.4],
        [0.8, 0.86, 1.0, 1.0, 0.7, 0.14],
    ),
    "warbird": (
        [0.0, 0.05, 0.26, 0.42, 0.6, 1.0],
        [0.66, 0.84, 0.96, 1.0, 0.76, 0.16],
        [-0.06, -0.04, 0.0, 0.02, 0.1, 0.35],
        [0.72, 0.9, 1.0, 1.0, 0.72, 0.12],
    ),
    "pod": (
        [0.0, 0.2, 0.33, 0.48, 0.62, 1.0],
        [1.0, 1.0, 0.95, 0.5, 0.3, 0.2],
        [-0.3, 0.0, 0.0, 0.1, 0.18, 0.3],
        [1.0, 1.0, 0.9, 0.48, 0.28, 0.18],
    ),
}


@dataclass(frozen=True)
class Fuselage:
    """Half-height, half-width and axis height as curves of x, and how boxy the section is."""

    height: Callable[[Array], Array]
    width: Callable[[Array], Array]
    axis: Callable[[Array], Array]
    square: float

    def at(self, x: float) -> tuple[float, float, float]:
        """Half-height, half-width and axis height at x."""
        s = np.clip(np.array([x]), 0.0, 1.0)
        return float(self.height(s)[0]), float(self.width(s)[0]), float(self.axis(s)[0])

    def part(self, top: Sequence[float], side: Sequence[float]) -> Part:
        """`top` and `side` are the x of FUSELAGE_TOP_V and FUSELAGE_SIDE_V, from the tail."""
        station = semantic_station(
            (FUSELAGE_TOP_V, _rising(top)), (FUSELAGE_SIDE_V, _rising(side)), (0.06, 0.2)
        )
        section = Superellipse(_tabled(self.height), _tabled(self.width), self.square)
        return Part(
            "fuselage", 0, 0.0, 1.0, section, centre=(_tabled(self.axis), 0.0), station=station
        )


def _rising(stations: Sequence[float], gap: float = 0.012) -> Array:
    """The stations made to rise from 0 to 1 by at least `gap` each."""
    x = np.array(stations, float)
    x[0], x[-1] = 0.0, 1.0
    for i in range(1, len(x) - 1):
        x[i] = max(x[i], x[i - 1] + gap)
    for i in range(len(x) - 2, 0, -1):
        x[i] = min(x[i], x[i + 1] - gap)
    return x


def _tabled(curve: Callable[[Array], Array], nodes: int = 1024) -> Callable[[Array], Array]:
    """The curve read once at stations dense towards both ends, linear in arccos(1 - 2 s)."""
    table = curve((1 - np.cos(np.pi * np.linspace(0, 1, nodes + 1))) / 2)

    def value(s: Array) -> Array:
        node = np.arccos(np.clip(1 - 2 * s, -1, 1)) * (nodes / np.pi)
        low = np.minimum(node.astype(np.intp), nodes - 1)
        rest = node - low
        return (1 - rest) * table.take(low) + rest * table.take(low + 1)

    return value


def random_fuselage(style: Style, rng: np.random.Generator) -> Fuselage:
    """A fuselage of the style's kind."""
    nose, tail, kind = style.nose, style.tail, style.fuselage
    blunt, stub = rng.uniform(1.7, 2.1), 0.012
    if kind == "cabin" and style.engines == "nose":
        kind, nose = "nose-prop", rng.uniform(0.02, 0.08)
    if kind == "warbird":
        nose, blunt = rng.uniform(0.02, 0.12), rng.uniform(2.0, 3.0)
    if kind in ("tube", "sleek"):
        droop = rng.uniform(0.15, 0.5)
        end = rng.uniform(0.08, 0.2)
        stations = [0.0, 0.45 * nose, nose, 1 - tail, 1 - 0.5 * tail, 1.0]
        height = [1.0, 1.0, 1.0, 1.0, rng.uniform(0.58, 0.7), end]
        axis = [-droop, -0.25 * droop, 0.0, 0.0, rng.uniform(0.18, 0.34), rng.uniform(0.35, 0.75)]
        width = [1.0, 1.0, 1.0, 1.0, rng.uniform(0.58, 0.75), rng.uniform(0.06, 0.16)]
        if kind == "sleek":
            blunt = rng.uniform(1.45, 1.8)
    elif kind == "jet":
        end = rng.uniform(0.5, 0.8)
        stations = [0.0, nose, 0.45, 0.75, 1.0]
        height = [0.8, rng.uniform(0.7, 0.9), 1.0, rng.uniform(0.9, 1.0), end]
        axis = [-rng.uniform(0.1, 0.35), -0.05, 0.0, 0.0, rng.uniform(-0.05, 0.15)]
        early = rng.uniform(0.6, 0.9) if style.aspect < 1.4 else 0.55
        width = [early, early, 1.0, rng.uniform(0.9, 1.0), end]
        blunt, stub = rng.uniform(1.25, 1.7), 0.0
    else:
        stations, height, axis, width = (list(x) for x in _PROFILES[kind])
        jitter = np.exp(0.06 * rng.normal(size=len(stations)))
        height = [h * j for h, j in zip(height, jitter, strict=True)]
        if kind == "pod":
            blunt = rng.uniform(1.7, 2.2)

    def curve(values: list[float], scale: float) -> Callable[[Array], Array]:
        return smooth([1 - x for x in stations[::-1]], [scale * v for v in values[::-1]])

    def shaped(values: list[float], scale: float) -> Callable[[Array], Array]:
        nosed = rounded(curve(values, scale), 0.0, nose, blunt)
        return rounded(nosed, stub, 0.0) if stub else nosed  # type: ignore[return-value]

    radius = style.radius
    return Fuselage(
        shaped(height, radius), shaped(width, radius * style.aspect), curve(axis, radius),
        style.square,
    )  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """A lifting surface from its root at the origin along +z; its leading edge faces +x.

    The chord is linear from root to `kink` to tip (both chords in root chords), mixed with an
    ellipse; `fillet` (length, fraction of the reach) draws the leading edge forward at the root.
    """

    reach: float
    chord: float
    taper: float
    sweep: float
    thick: tuple[float, float]
    dihedral: float = 0.0
    camber: float = 0.0
    kink: tuple[float, float] | None = None
    ellipse: float = 0.0
    fillet: tuple[float, float] = (0.0, 0.25)
    tip: float = 0.03
    bend: float = 0.0

    def _chord(self, eta: Array) -> Array:
        if self.kink is None:
            straight = linear([0, 1], [1, self.taper])(eta)
        else:
            straight = linear([0, self.kink[0], 1], [1, self.kink[1], self.taper])(eta)
        oval = np.sqrt(np.maximum(1 - eta**2, 0.0))
        return self.chord * ((1 - self.ellipse) * straight + self.ellipse * oval)

    def _forward(self, eta: Array) -> Array:
        length, extent = self.fillet
        if not length:
            return np.zeros_like(eta)
        return length * np.clip(1 - eta / extent, 0, 1) ** 1.5

    def edge(self, eta: Array) -> Array:
        """x of the leading edge without fillet."""
        pull = 0.25 * self.ellipse * (self._chord(np.zeros_like(eta)) - self._chord(eta))
        return -np.tan(self.sweep) * self.reach * eta - pull

    def lift(self, eta: Array) -> Array:
        """y of the chord plane."""
        return self.reach * (np.tan(self.dihedral) * eta + self.bend * eta**2)

    def at(self, eta: float) -> tuple[float, float, float, float]:
        """x of the leading edge, y, z and the chord at a fraction of the reach."""
        e = np.array([eta])
        return (
            float(self.edge(e)[0]), float(self.lift(e)[0]), eta * self.reach,
            float(self._chord(e)[0]),
        )  # fmt: skip

    def part(self, slot: str, root: float = 0.0) -> Part:
        """The surface as a part; `root` is the z at which it leaves the fuselage."""

        def half(s: Array) -> Array:
            return (self._chord(s) + self._forward(s)) / 2

        def middle(s: Array) -> Array:
            return self.edge(s) + self._forward(s) - half(s)

        section = Airfoil(
            rounded(half, 0.0, self.tip), linear([0, 1], self.thick), self.camber, edge=0.022
        )
        eta = min(max(root / self.reach, 0.01), 0.8)
        inner = [0, ROOT_V, 1], [0, eta, 1]
        return Part(
            slot, 2, 0.0, self.reach, section, centre=(middle, self.lift),
            station=lambda u, v: np.interp(v, *inner),
        )  # fmt: skip


def moved(x: float, y: float, z: float) -> Affine:
    """A translation."""
    return Affine(np.eye(3), np.array([x, y, z]))


def upright(cant: float = 0.0) -> Affine:
    """Turns +z (a surface's reach) to +y, leaning by `cant` (rad) towards +z."""
    return rotation(0, cant - np.pi / 2)


def both(right: Part) -> list[Part]:
    """A right part (slot containing "right") and its mirror image."""
    return [right, right.mirrored(right.slot.replace("right", "left"))]


def nacelle(
    slot: str,
    front: tuple[float, float, float],
    length: float,
    radius: float,
    rng: np.random.Generator,
    prop: bool = False,
) -> Part:
    """An engine's housing whose intake or spinner is at `front` (x, y, z)."""
    x, y, z = front
    if prop:
        body = rounded(smooth([0, 0.5, 1], [radius * 0.25, radius, radius * 0.8]), 0.1, 0.12)
        tall = float(rng.uniform(1.0, 1.3))
        section = Superellipse(lambda s: tall * np.asarray(body(s)), body, 2.2)  # type: ignore[operator]
        return Part(
            slot, 0, x - length, x, section, centre=(linear([0, 1], [y + 0.4 * radius, y]), z)
        )
    lip = rng.uniform(0.82, 0.95)
    aft = rng.uniform(0.45, 0.7)
    profile = smooth(
        [0, 0.3, 0.65, 0.92, 1], [aft * radius, 0.8 * radius, radius, 0.97 * radius, lip * radius]
    )
    hollow = dish(0, x - length, x, (y, z), 0.9 * lip * radius, rng.uniform(0.0, 0.2) * length)
    return Part(
        slot, 0, x - length, x, Superellipse(profile, profile, 2.0), centre=(y, z), maps=(hollow,)
    )


def pylon(
    slot: str, start: Sequence[float], stop: Sequence[float], axis: int, half: tuple[float, float]
) -> Part:
    """A thin bar along y (1) or z (2); `half` is its half-length in x at start and stop."""
    thin = 0.0045
    long = linear([0, 1], half)
    return bar(slot, axis, start, stop, (thin, long) if axis == 1 else (long, thin), 3.0)


def propeller(
    name: str, hub: tuple[float, float, float], radius: float, rng_state: tuple[int, float, float]
) -> list[Part]:
    """Blades `propeller-<name>-<k>` in the plane x = hub[0]; state: count, phase (rad), width."""
    count, phase, width = rng_state
    parts = []
    for k in range(count):
        section = Superellipse(
            rounded(smooth([0, 0.35, 1], [0.5 * width, width, 0.7 * width]), 0.0, 0.2),
            0.22 * width,
            2.0,
        )
        blade = Part(f"propeller-{name}-{k + 1}", 1, 0.0, radius, section)
        turned = blade.mapped(rotation(1, 0.45), rotation(0, phase + 2 * np.pi * k / count))
        parts.append(turned.mapped(moved(*hub)))
    return parts


def wheel(slot: str, centre: tuple[float, float, float], radius: float, width: float) -> Part:
    """An undercarriage's wheel."""
    x, y, z = centre
    return blob(slot, 2, z - width, z + width, (radius, radius), (x, y), 2.0, (0.25, 0.25))
