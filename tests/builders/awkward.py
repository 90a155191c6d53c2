"""Clouds that scans and bad exports are: repeated, nearly equal, flat, tiny, huge, far away."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

SCALES = (1e-300, 1e-160, 1e-30, 1e-9, 1e-3, 1.0, 1e3, 1e9, 1e30, 1e160, 1e300)

OFFSETS = (0.0, 1e-3, 1.0, 1e6, 1e17)
"""Longest sides from the origin."""


@st.composite
def clouds(draw, least: int = 1, most: int = 300, scales=SCALES, offsets=OFFSETS):
    """Points (n, 3), finite, and unit normals (n, 3)."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    points = rng.normal(size=(draw(st.integers(least, most)), 3))
    count = len(points)
    for kind in draw(st.lists(st.sampled_from(sorted(KINDS)), max_size=3)):
        KINDS[kind](rng, points, count)
    points /= max(np.abs(points).max(), 1e-300)
    points += draw(st.sampled_from(offsets))
    with np.errstate(over="ignore"):
        points = points * draw(st.sampled_from(scales))
    points = np.clip(points, -1.7e308, 1.7e308)
    normals = rng.normal(size=points.shape)
    return points, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def _cluster(rng, points, count):
    chosen = rng.integers(0, count, max(int(count * rng.choice([0.25, 1.0, 3.0])), 2))
    spread = 10.0 ** rng.uniform(-18, -3) * rng.normal(size=(len(chosen), 3))
    points[chosen] = points[chosen[0]] + spread


def _near_zero(rng, points, count):
    chosen = rng.integers(0, count, max(count // 4, 2))
    points[chosen] = 10.0 ** rng.uniform(-320, -3) * rng.normal(size=(len(chosen), 3))


def _next(rng, points, count):
    points[rng.integers(count)] = np.nextafter(points[rng.integers(count)], np.inf)


def _repeated(rng, points, count):
    points[:] = points[rng.integers(0, max(int(count * rng.choice([0.02, 0.5])), 1), count)]


def _pair(rng, points, count):
    points[rng.integers(count)] = points[rng.integers(count)]


def _all_equal(rng, points, count):
    points[:] = points[0]


def _flat(rng, points, count):
    points[:, rng.integers(3)] = points[0, 0]


def _lattice(rng, points, count):
    points[:] = np.round(4.0 * points) / 4.0


def _outlier(rng, points, count):
    points[rng.integers(count)] *= 10.0 ** rng.uniform(0, 12)


KINDS = {
    "all equal": _all_equal,
    "cluster": _cluster,
    "flat": _flat,
    "lattice": _lattice,
    "near zero": _near_zero,
    "next number": _next,
    "outlier": _outlier,
    "pair": _pair,
    "repeated": _repeated,
}
