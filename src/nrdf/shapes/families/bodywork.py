"""A car's bodywork: one loft from tail to nose whose profile, plan and section all vary.

The loft's surface coordinates are semantic. Along the body, v has breakpoints at the tail, the
boot's rear edge, the rear window's base and top, the windscreen's top and base, the bonnet's front
edge and the nose on top, and at the wheel arches on the sides. Around it, u has breakpoints at the
roof's edge, the belt line and the sill. Lengths are metres; y = 0 is the ground, x = 0 the tail.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nrdf.shapes.families.sections import Array, Curve, at

TOP_V = np.array([0.0, 0.08, 0.18, 0.30, 0.52, 0.68, 0.90, 1.0])
"""v of: tail, boot edge, rear window base, its top, windscreen top, its base, bonnet edge, nose."""

SIDE_V = np.array([0.0, 0.10, 0.19, 0.28, 0.62, 0.72, 0.82, 1.0])
"""v of: tail, rear arch's rear, axle and front, front arch's rear, axle and front, nose."""

EDGE_U, SHOULDER_U, BELT_U, SILL_U, FLOOR_U = 0.14, 0.18, 0.25, 0.37, 0.42
"""u, folded to [0, 0.5], of the roof's edge, its rounding's end, belt line, sill and floor edge."""

_NODES = 2048


def ramp(x: Array, radius: Array | float) -> Array:
    """max(x, 0) with the corner replaced by a parabola over [-radius, radius]."""
    r = np.maximum(radius, 1e-9)
    return np.where(x >= r, x, np.square(np.clip(x + r, 0, None)) / (4 * r))


def filleted(
    knots: Sequence[float], values: Sequence[float] | Array, radii: Sequence[float]
) -> Callable[[Array], Array]:
    """Straight lines through (knots, values), each inner corner rounded by a parabola.

    `radii` are half the fillets' lengths, one for each inner knot; they are cut to half of the
    shorter neighbouring line.
    """
    x, y = np.asarray(knots, float), np.asarray(values, float)
    step = np.diff(x)
    slope = np.diff(y) / step
    r = np.minimum(np.asarray(radii, float), 0.499 * np.minimum(step[:-1], step[1:]))
    bend = np.diff(slope)

    def value(s: Array) -> Array:
        out = y[0] + slope[0] * (s - x[0])
        for corner, turn, radius in zip(x[1:-1], bend, r, strict=True):
            out = out + turn * ramp(s - corner, float(radius))
        return out

    return value


def shrinking(curve: Curve, centre: float, tail: End, nose: End) -> Callable[[Array], Array]:
    """The curve, drawn towards `centre` at both ends like the quarter of a superellipse."""

    def value(s: Array) -> Array:
        keep = np.ones_like(s)
        for end, depth in ((tail, s), (nose, 1 - s)):
            if end.length > 0:
                x = np.clip(1 - depth / end.length, 0, 1)
                quarter = np.maximum(1 - x**end.exponent, 0) ** (1 / end.exponent)
                keep = keep * (end.keep + (1 - end.keep) * quarter)
        return centre + (at(curve, s) - centre) * keep

    return value


@dataclass(frozen=True)
class End:
    """How one end is rounded: over which fraction of the length, down to which fraction."""

    length: float
    keep: float
    exponent: float = 2.0


@dataclass(frozen=True)
class Well:
    """A wheel's arch: a recess of both sides around (x, y), with a flare of the wing above."""

    x: float
    y: float
    radius: float
    depth: float
    flare: float


@dataclass(frozen=True)
class Bodywork:
    """The section of a car body; p is height above `centre`, q is z. Curves are of s.

    bottom, top: the profile at z = 0; width: half the plan; belt: height above which the sides
    lean in by `tumblehome` (slope) and `curvature` (1/m); crown, crown_e: height and exponent of
    the rounding at the top; floor, floor_e: at the bottom; barrel (1/m^2): bulge of the sides
    about the height `waist`; edge: softness of belt line and arches.

    The curves are read once, at 2049 stations dense towards the ends; the shape is what lies
    between, linear in arccos(1 - 2 s).
    """

    length: float
    centre: float
    bottom: Curve
    top: Curve
    width: Curve
    belt: Curve
    tumblehome: float
    curvature: float
    crown: Curve
    crown_e: float
    floor: float
    floor_e: float
    barrel: float
    waist: float
    wells: tuple[Well, ...]
    edge: float = 0.03

    @cached_property
    def _table(self) -> Array:
        """Bottom, top, width, belt and crown (5, 2049)."""
        s = (1 - np.cos(np.pi * np.linspace(0, 1, _NODES + 1))) / 2
        curves = (self.bottom, self.top, self.width, self.belt, self.crown)
        return np.stack([at(curve, s) + 0 * s for curve in curves])

    def curves(self, s: Array) -> tuple[Array, ...]:
        """Bottom, top, width, belt, floor and crown (n,), the last two cut to fit the height."""
        node = np.arccos(np.clip(1 - 2 * s, -1, 1)) * (_NODES / np.pi)
        low = np.minimum(node.astype(np.intp), _NODES - 1)
        rest, high = node - low, low + 1
        bottom, top, width, belt, crown = (
            (1 - rest) * row.take(low) + rest * row.take(high) for row in self._table
        )
        room = 0.45 * (top - bottom)
        return bottom, top, width, belt, np.minimum(self.floor, room), np.minimum(crown, room)

    def _side(self, y: Array, s: Array, width: Array, belt: Array) -> Array:
        """Half-width at height y without the rounding at top and bottom."""
        above = ramp(y - belt, self.edge)
        width = width * (1 - self.barrel * (y - self.waist) ** 2)
        width -= above * (self.tumblehome + self.curvature * above)
        x = s * self.length
        for well in self.wells:
            near = np.flatnonzero(np.abs(x - well.x) < 1.5 * well.radius)
            distance = np.hypot(x[near] - well.x, y[near] - well.y)
            width[near] += well.flare * _step(3 - 2 * distance / well.radius)
            width[near] -= well.depth * _step((well.radius - distance) / self.edge + 0.5)
        return np.maximum(width, 0.05)

    def half_width(self, s: Array) -> Array:
        bottom, top, *_ = self.curves(s)
        return np.maximum(top - self.centre, self.centre - bottom)

    def disc(self, u: Array, rho: Array, s: Array) -> tuple[Array, Array]:
        u = u - np.floor(u)
        fold = np.minimum(u, 1 - u)
        bottom, top, width, belt, floor, crown = self.curves(s)
        upper, lower = top - crown, bottom + floor
        shoulder = np.clip(belt, lower, lower + 0.93 * (upper - lower))
        above = np.clip((fold - SHOULDER_U) / (BELT_U - SHOULDER_U), 0, 1)
        below = np.clip((fold - BELT_U) / (SILL_U - BELT_U), 0, 1)
        y = upper + above * (shoulder - upper) + below * (lower - shoulder)
        breadth = np.ones_like(y)
        for depth, knots, height, e in (
            (fold, [0, EDGE_U, SHOULDER_U], crown, self.crown_e),
            (0.5 - fold, [0, 0.5 - FLOOR_U, 0.5 - SILL_U], -floor, self.floor_e),
        ):
            here = np.flatnonzero(depth < knots[-1])
            angle = np.interp(depth[here], knots, [np.pi / 2, np.pi / 4, 0.0])
            cosine, sine = np.abs(np.cos(angle)), np.sin(angle)
            radius = (cosine**e + sine**e) ** (-1 / e)
            y[here] += height[here] * radius * sine
            breadth[here] = radius * cosine
        z = self._side(y, s, width, belt) * breadth
        return rho * (y - self.centre), rho * np.where(u <= 0.5, z, -z)

    def breadth(self, y: Array, s: Array) -> Array:
        """Half-width at height y, rounding included; negative outside the profile."""
        bottom, top, width, belt, floor, crown = self.curves(s)
        side = self._side(y, s, width, belt)
        for depth, height, e in (
            (y - top + crown, crown, self.crown_e),
            (bottom + floor - y, floor, self.floor_e),
        ):
            here = np.flatnonzero(depth > 0)
            t = depth[here] / np.maximum(height[here], 1e-12)
            side[here] *= np.maximum(1 - t**e, 0) ** (1 / e)
        return np.where((y >= bottom) & (y <= top), side, -1.0)

    def inside(self, p: Array, q: Array, s: Array) -> NDArray[np.bool_]:
        return np.abs(q) <= self.breadth(p + self.centre, s)

    def chord(self, xi: Array, s: Array) -> tuple[Array, Array]:
        z = np.maximum(self.breadth(self.centre + xi * self.half_width(s), s), 0)
        return -z, z


def _step(x: Array) -> Array:
    """0 below 0, 1 above 1, smooth between."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)
