"""Words that cars and aircraft share: semantic stations along a body, dished ends, blobs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nrdf.shapes.families.base import Part, Warp
from nrdf.shapes.families.sections import Array, Superellipse, rounded

Knots = tuple[Sequence[float] | Array, Sequence[float] | Array]


def semantic_station(
    top: Knots, side: Knots, mix: tuple[float, float]
) -> Callable[[Array, Array], Array]:
    """(u, v) to s for a body along x, from knots (v, s) of its top and of its sides.

    With u folded to [0, 0.5], the top's knots hold up to mix[0], the sides' from mix[1] on, and
    between the two s is mixed. The last interval at each end is spaced like a quarter circle,
    because the ends are rounded.
    """

    def along(v: Array, knots: Array, values: Array) -> Array:
        s = np.interp(v, knots, values)
        first, last = np.clip(1 - v / knots[1], 0, 1), np.clip(1 - (1 - v) / (1 - knots[-2]), 0, 1)
        s = np.where(first > 0, values[1] * (1 - np.sin(np.pi / 2 * first)), s)
        return np.where(last > 0, values[-2] + (1 - values[-2]) * np.sin(np.pi / 2 * last), s)

    top_knots, side_knots = np.asarray(top, float), np.asarray(side, float)

    def station(u: Array, v: Array) -> Array:
        u = u - np.floor(u)
        weight = np.interp(np.minimum(u, 1 - u), mix, [1.0, 0.0])
        return weight * along(v, *top_knots) + (1 - weight) * along(v, *side_knots)

    return station


def dish(
    axis: int, start: float, stop: float, centre: Sequence[float], radius: float, depth: float
) -> Warp:
    """Hollows the end at `stop` of a loft along `axis` by `depth` (raises it where negative).

    `centre` is (p, q) of the hollow's middle; the warp vanishes at `radius` and at `start`.
    """

    def scale(p: Array, q: Array) -> Array:
        near = np.clip(1 - ((p - centre[0]) ** 2 + (q - centre[1]) ** 2) / radius**2, 0, 1)
        return 1 - depth / (stop - start) * near * (2 - near)

    return Warp(axis, scale=scale, anchor=start)


def blob(
    slot: str,
    axis: int,
    low: float,
    high: float,
    half: tuple[float, float],
    centre: tuple[float, float],
    e: float = 2.5,
    ends: tuple[float, float] = (0.4, 0.4),
) -> Part:
    """A superellipse loft with half-widths (p, q), rounded over the fractions `ends`."""
    section = Superellipse(rounded(half[0], *ends, 2.5), rounded(half[1], *ends, 2.5), e)
    return Part(slot, axis, low, high, section, centre=centre)
