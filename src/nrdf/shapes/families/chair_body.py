"""Seat and back of a chair. Lengths in metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.shapes.families.base import Part, Warp, Window
from nrdf.shapes.families.chair_styles import Style
from nrdf.shapes.families.furniture import chance, pick
from nrdf.shapes.families.sections import Array, Curve, Superellipse, at, linear, rounded, smooth


@dataclass(frozen=True)
class Seat:
    """What the other parts need to know of the seat."""

    part: Part
    top: float
    half_width: float
    half_depth: float
    thickness: float
    corner: float  # of the outline on its diagonal, as a fraction of the box's corner
    flare: float

    def height(self, x: float, z: float) -> float:
        """The seat's middle height at (x, z), as warped."""
        point = np.array([[x, self.top - self.thickness / 2, z]])
        for step in self.part.maps:
            if isinstance(step, Warp) and step.axis == 1:
                point = step.forward(point)
        return float(point[0, 1])

    def width_at(self, x: float) -> float:
        """The half-width factor of a seat that flares towards the front."""
        return 1 + self.flare * x / self.half_depth


def random_seat(
    rng: np.random.Generator, style: Style, kind: str, plinth: bool, boxy: bool
) -> Seat:
    """A seat; on a plinth it is solid down to the floor; boxy between sofa arms."""
    top, half_width = rng.uniform(*style.seat_height), rng.uniform(*style.half_width)
    half_depth = rng.uniform(*style.half_depth)
    low, high = style.seat_thickness
    thickness = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    if plinth:
        thickness = top - rng.uniform(0.0, 0.04)
    front = float(rng.choice([2.3, 3.0, 5.0, 10.0, 40.0], p=[0.13, 0.17, 0.25, 0.25, 0.2]))
    rear = front if chance(rng, 0.6) else float(rng.choice([2.5, 6.0, 40.0]))
    if boxy:
        front = rear = max(front, 8.0)
    if kind == "tub":
        front, rear = max(front, 4.0), 2.3
    fillet = min(rng.uniform(0, 0.5) * thickness / half_width, 0.3)
    edges = rng.uniform(0, 0.5), rng.uniform(0.1, 0.6)
    a, b = (rounded(x, *edges, depth=fillet) for x in (half_width, half_depth))
    flare = rng.uniform(0, 0.22) if chance(rng, 0.5) and kind != "tub" and not boxy else 0.0
    maps = [Warp(2, scale=lambda x, y: 1 + flare * x / half_depth)] if flare else []
    maps += _seat_shape(rng, kind, top, thickness, half_width, half_depth)
    part = Part(
        "seat", 1, top - thickness, top, Superellipse(a, b, front, e_low=rear), maps=tuple(maps)
    )
    corner = 2 ** (-1 / min(front, rear))
    return Seat(part, top, half_width, half_depth, thickness, corner, flare)


def _seat_shape(
    rng: np.random.Generator,
    kind: str,
    top: float,
    thickness: float,
    half_width: float,
    half_depth: float,
) -> list[Warp]:
    """Tilt, hollow and waterfall edge of the whole seat; dome or saddle of its top only."""
    tilt = np.tan(np.radians(rng.uniform(0, 14 if kind == "lounge" else 6)))
    shaped = kind == "shell" or chance(rng, 0.25)
    hollow = rng.uniform(0.01, 0.05) if shaped else 0.0
    waterfall = rng.uniform(0, 0.05) if shaped else 0.0
    rear_rise = rng.uniform(0, 0.06) if kind == "shell" else 0.0

    def offset(z: Array, x: Array) -> Array:
        f = x / half_depth
        bowl = hollow * (z / half_width) ** 2 * np.clip(1.2 - f, 0, 2)
        fall = waterfall * np.clip(f - 0.3, 0, None) ** 2
        return tilt * x + bowl - fall + rear_rise * np.clip(-f - 0.4, 0, None) ** 2

    maps = [Warp(1, offset=offset)]
    if thickness > 0.025 and chance(rng, 0.5):
        dome = rng.uniform(-0.3 if thickness < 0.12 else 0.0, 0.5) * min(1, 0.1 / thickness)

        def swell(z: Array, x: Array) -> Array:
            round_z = np.clip(1 - (z / (1.3 * half_width)) ** 2, 0.1, 1)
            return 1 + dome * round_z * np.clip(1 - (x / (1.3 * half_depth)) ** 2, 0.1, 1)

        maps.insert(0, Warp(1, scale=swell, anchor=top - thickness))
    return maps


def _outline(rng: np.random.Generator, bottom: float, upper: float, plain: bool) -> Curve:
    """Half-width of a back along its height; plain ones are wide all the way up."""
    weights = {"straight": 4, "bulge": 1.5, "arch": 2.5, "oval": 0.8, "crest": 1.5, "head": 0.5}
    kind = pick(rng, {name: weights[name] for name in list(weights)[: 2 if plain else None]})
    if kind == "bulge":
        middle = max(bottom, upper) * rng.uniform(0.85, 1.25)
        return smooth([0, rng.uniform(0.35, 0.65), 1], [bottom, middle, upper])
    if kind == "crest":
        s, wide = rng.uniform(0.68, 0.9), upper * rng.uniform(1.05, 1.3)
        return linear([0, s, s + 0.015, 1], [bottom, upper, wide, wide * rng.uniform(0.9, 1.1)])
    if kind == "head":
        s, neck, head = rng.uniform(0.68, 0.78), rng.uniform(0.2, 0.5), rng.uniform(0.5, 0.9)
        knots = [0, 0.5, s, s + 0.03, s + 0.06, s + 0.09, 1]
        factors = np.array([0.85, 1, 0.9, neck, neck, head, head * 0.9])
        return smooth(knots, upper * factors)
    straight = linear([0, 1], [bottom, upper])
    if kind == "arch":
        return rounded(straight, 0, rng.uniform(0.12, 0.6), rng.uniform(2, 3.5), 0.97)
    if kind == "oval":
        return rounded(straight, rng.uniform(0.3, 0.5), 0.5, rng.uniform(2, 3), 0.95)
    return straight


def _windows(rng: np.random.Generator, thin: bool) -> tuple[Window, ...]:
    """Gaps of a back: between slats or spindles, frames, splats, ladders, lattices."""
    side, bottom = rng.uniform(0.08, 0.25), rng.uniform(-0.2, 0.22)
    top = 1 - rng.uniform(0.07, 0.4)
    inner = 1 - side
    kind = pick(
        rng,
        {"vertical": 4, "ladder": 2.5, "frame": 1, "splat": 1.5, "below": 2, "lattice": 0.5,
         "both": 1, "stem": 0.6, "handle": 0.5},
    )  # fmt: skip

    def columns(count: int, share: float, s0: float, s1: float, code: int) -> list[Window]:
        pitch = 2 * inner / (count - 1 + share) if count > 1 else 2 * inner / share
        half = share * pitch / 2
        return [
            Window(
                -inner + half + i * pitch, (s0 + s1) / 2, half, (s1 - s0) / 2,
                key=1000 * code + 32 * count + i,
            )
            for i in range(count)
        ]  # fmt: skip

    def rows(count: int, share: float, s0: float, s1: float, code: int) -> list[Window]:
        pitch = (s1 - s0) / (count - 1 + share)
        half = share * pitch / 2
        return [
            Window(0, s0 + half + i * pitch, inner, half, key=1000 * code + 32 * count + i)
            for i in range(count)
        ]

    if kind == "vertical":
        return tuple(
            columns(int(rng.integers(2, 10)), rng.uniform(0.35, 0.85), bottom, top, code=1)
        )
    if kind == "ladder":
        return tuple(rows(int(rng.integers(1, 7)), rng.uniform(0.4, 0.75), bottom, top, code=2))
    if kind == "frame":
        e = float(rng.choice([2.0, 3.0, np.inf]))
        s0 = max(bottom, 0.05) if e < np.inf else bottom
        return (Window(0, (s0 + top) / 2, inner, (top - s0) / 2, e, key=3000),)
    if kind == "splat":
        return tuple(columns(2, rng.uniform(0.55, 0.85), bottom, top, code=1))
    if kind == "below":
        s1 = rng.uniform(0.15, 0.6)
        return (Window(0, s1 / 2 - 0.1, inner, s1 / 2 + 0.1, key=4000),)
    if kind == "both":
        s1 = rng.uniform(0.1, 0.3)
        below = Window(0, s1 / 2 - 0.1, inner, s1 / 2 + 0.1, key=4000)
        s0 = s1 + rng.uniform(0.06, 0.12)
        slats = columns(int(rng.integers(2, 8)), rng.uniform(0.4, 0.8), s0, max(top, s0 + 0.2), 1)
        return (below, *slats)
    if kind == "stem":
        s1, stem = rng.uniform(0.2, 0.5), rng.uniform(0.1, 0.3)
        half, at_xi = (1.2 - stem) / 2, (1.2 + stem) / 2
        return tuple(
            Window(sign * at_xi, s1 / 2 - 0.1, half, s1 / 2 + 0.1, key=5000 + (sign > 0))
            for sign in (-1, 1)
        )
    if kind == "handle":
        return (Window(0, rng.uniform(0.8, 0.9), rng.uniform(0.15, 0.4), 0.04, 3.0, key=6000),)
    count = int(rng.integers(2, 4))
    tall = rows(int(rng.integers(2, 5)), rng.uniform(0.6, 0.85), max(bottom, 0.03), top, code=7)
    return tuple(
        Window(c.xi, r.s, c.half_xi, r.half_s, key=8000 + 512 * count + 32 * j + len(tall) * 8 + i)
        for j, r in enumerate(tall)
        for i, c in enumerate(columns(count, 0.85, 0, 1, 1))
    )


@dataclass(frozen=True)
class Back:
    """What arms and wings need to know of the back."""

    part: Part
    bottom: float
    height: float

    def edge(self, y: float) -> tuple[float, float, float]:
        """x, z and half-thickness of the right edge's middle at height y."""
        s = np.array([(y - self.bottom) / self.height])
        z = np.ravel(self.part.section.half_width(s))[0]
        point = np.array([[0.0, y, 0.92 * z]])
        for step in self.part.maps:
            point = step.forward(point)
        section = self.part.section
        thick = np.ravel(at(section.b, s))[0] if isinstance(section, Superellipse) else 0.0
        return float(point[0, 0]), float(point[0, 2]), float(thick)


def random_back(rng: np.random.Generator, style: Style, kind: str, seat: Seat) -> Back:
    """A back that rises from the seat's rear edge (office backs may float above it)."""
    low, high = style.back_thickness
    half = float(np.exp(rng.uniform(np.log(low), np.log(high)))) / 2
    height = rng.uniform(*style.back_height)
    rear_width = seat.half_width * seat.width_at(-seat.half_depth)
    bottom_width = rear_width * rng.uniform(0.72, 1.02)
    top_width = bottom_width * rng.uniform(0.75, 1.2)
    sofa = kind == "upholstered" and chance(rng, 0.6)
    if sofa:
        bottom_width, top_width = rear_width * rng.uniform([0.95, 0.9], [1.1, 1.15])
    width = _outline(rng, bottom_width, top_width, plain=sofa)
    below = rng.uniform(0.3, 0.7) * seat.thickness
    x0 = -seat.half_depth + half * rng.uniform(-0.5, 1.2)
    floating = kind == "office" and chance(rng, 0.5)
    base = seat.height(x0, 0) - seat.thickness / 2 + below if not floating else seat.top + 0.08
    slope = np.tan(np.radians(rng.uniform(*style.recline)))
    bend, lumbar = rng.uniform(-0.06, 0.1), rng.uniform(-0.02, 0.04)
    if chance(rng, 0.3):
        bend = lumbar = 0.0
    knots = np.linspace(0, 1, 9)
    line = x0 - height * slope * knots - bend * knots**2 * height / 0.5
    line += lumbar * np.sin(np.pi * np.clip(2 * knots, 0, 1.0))
    wrap = seat.half_depth * rng.uniform(*style.wrap) if chance(rng, 0.7) else 0.0
    if kind == "tub":
        wrap = seat.half_depth * rng.uniform(*style.wrap)
        width = linear([0, 1], [rear_width * rng.uniform(0.9, 1.0), rear_width * 1.08])
    power = rng.uniform(2, 3) if kind != "tub" else rng.uniform(2, 2.6)
    fall = rng.uniform(0, 1) if kind == "tub" else rng.uniform(-0.3, 0.7)
    centre = smooth(knots, line)

    def forward(y: Array, z: Array) -> tuple[Array, Array]:
        """How far the back reaches forward at (y, z), and its slope along z."""
        s = np.clip((y - base) / height, 0, 1)
        f, reach = np.abs(z) / rear_width, wrap * (1 - fall * s)
        return centre(s) + reach * f**power, reach * power / rear_width * f ** (power - 1)

    maps = [Warp(0, offset=lambda y, z: forward(y, z)[0])]
    if wrap:
        maps.insert(0, Warp(0, scale=lambda y, z: np.sqrt(1 + forward(y, z)[1] ** 2)))
    taper = rng.uniform(0.5, 1.1)
    b: Curve = linear([0, 1], [half, half * taper])
    soft = half > 0.02
    if soft:
        b = rounded(b, 0, rng.uniform(0.03, 0.2), depth=rng.uniform(0.2, 0.8))
        width = rounded(width, 0, rng.uniform(0.02, 0.1), depth=rng.uniform(0.03, 0.2))
    pierced = chance(rng, style.pierced)
    e = float(rng.choice([4.0, 6.0, 10.0, 20.0, 40.0]))
    part = Part(
        "back",
        1,
        base,
        base + height,
        Superellipse(width, b, e if not pierced else max(e, 8.0)),
        windows=_windows(rng, half < 0.03) if pierced else (),
        maps=tuple(maps),
    )
    return Back(part, base, height)
