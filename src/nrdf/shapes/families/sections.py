"""Curves along a loft and the cross-sections it is made of.

A section lives in the plane of two local coordinates (p, q) and varies with s in [0, 1], the
fraction of the way along the loft. Its boundary is walked by u in [0, 1): u = 0 points along +p,
u = 1/4 along +q, u = 1/2 along -p, u = 3/4 along -q.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

Array = NDArray[np.float64]
Curve = float | Callable[[Array], Array]
"""A constant, or a function of s (n,) in [0, 1] that returns (n,)."""

Knots = Sequence[float] | NDArray[np.floating]

TINY = 1e-12


def at(curve: Curve, s: Array) -> Array | float:
    """The curve's value at s (n,): a float for a constant, else (n,)."""
    return curve(s) if callable(curve) else float(curve)


def linear(knots: Knots, values: Knots) -> Callable[[Array], Array]:
    """Piecewise linear curve through (knots, values), constant beyond both ends."""
    x, y = np.asarray(knots, float), np.asarray(values, float)
    return lambda s: np.interp(s, x, y)


def smooth(knots: Knots, values: Knots) -> Callable[[Array], Array]:
    """Monotone cubic curve (PCHIP: no overshoot) through (knots, values), constant beyond."""
    x, y = np.asarray(knots, float), np.asarray(values, float)
    cubic = PchipInterpolator(x, y)
    return lambda s: cubic(np.clip(s, x[0], x[-1]))


def rounded(
    curve: Curve, start: float, stop: float, exponent: float = 2.0, depth: float = 1.0
) -> Curve:
    """The curve, falling at s = 0 over `start` and at s = 1 over `stop`, like an ellipse.

    `start` and `stop` are fractions of the loft's length (0 keeps that end square); a larger
    exponent gives a blunter end; at the very end the curve is 1 - depth of itself (a fillet).
    """

    def value(s: Array) -> Array:
        factor = np.ones_like(s)
        if start > 0:
            factor = factor * _quarter(np.clip((start - s) / start, 0, 1), exponent)
        if stop > 0:
            factor = factor * _quarter(np.clip((s - 1 + stop) / stop, 0, 1), exponent)
        return at(curve, s) * (1 - depth * (1 - factor))

    return value


def _quarter(x: Array, exponent: float) -> Array:
    if exponent == 2.0:
        return np.sqrt((1 - x) * (1 + x))
    return np.maximum(1 - x**exponent, 0) ** (1 / exponent)


class Section(Protocol):
    """What a loft needs from its cross-section; all arrays are (n,)."""

    def half_width(self, s: Array) -> Array | float:
        """Half-width along p, the unit of the window coordinate xi."""

    def disc(self, u: Array, rho: Array, s: Array) -> tuple[Array, Array]:
        """(p, q) from the section's centre; rho = 1 is the boundary, rho < 1 the inside."""

    def inside(self, p: Array, q: Array, s: Array) -> NDArray[np.bool_]:
        """Whether (p, q) lies in the section."""

    def chord(self, xi: Array, s: Array) -> tuple[Array, Array]:
        """Lower and upper q at p = xi * half-width, |xi| <= 1."""


@dataclass(frozen=True)
class Superellipse:
    """|p / a|^e + |q / b|^e <= 1, with other b and e for q < 0 where given.

    e = 2 is an ellipse, 1 a diamond, 4 to 8 a rounded box, 40 a box. u is the polar angle of
    (p / a, q / b), so that the corners of every box sit at odd eighths of u.
    """

    a: Curve
    b: Curve
    e: Curve = 2.0
    b_low: Curve | None = None
    e_low: Curve | None = None

    def half_width(self, s: Array) -> Array | float:
        return at(self.a, s)

    def _upper_lower(self, s: Array, upper: NDArray[np.bool_]) -> tuple[Array | float, ...]:
        b, e = at(self.b, s), at(self.e, s)
        if self.b_low is not None:
            b = np.where(upper, b, at(self.b_low, s))
        if self.e_low is not None:
            e = np.where(upper, e, at(self.e_low, s))
        return b, e

    def disc(self, u: Array, rho: Array, s: Array) -> tuple[Array, Array]:
        cosine, sine = np.cos(2 * np.pi * u), np.sin(2 * np.pi * u)
        b, e = self._upper_lower(s, sine >= 0)
        radius = rho
        if not (isinstance(e, float) and e == 2.0):
            radius = rho * (np.abs(cosine) ** e + np.abs(sine) ** e) ** (-1.0 / np.asarray(e))
        return at(self.a, s) * radius * cosine, b * radius * sine

    def inside(self, p: Array, q: Array, s: Array) -> NDArray[np.bool_]:
        b, e = self._upper_lower(s, q >= 0)
        x = np.abs(p) / np.maximum(at(self.a, s), TINY)
        y = np.abs(q) / np.maximum(b, TINY)
        if isinstance(e, float) and e == 2.0:
            return x * x + y * y <= 1
        box = np.maximum(x, y) <= 1
        with np.errstate(over="ignore"):
            return box & (np.minimum(x, 1.1) ** e + np.minimum(y, 1.1) ** e <= 1)

    def chord(self, xi: Array, s: Array) -> tuple[Array, Array]:
        def half(upper: bool) -> Array:
            b, e = self._upper_lower(s, np.full(xi.shape, upper))
            return b * np.maximum(1 - np.abs(xi) ** e, 0) ** (1.0 / np.asarray(e))

        return -half(False), half(True)


@dataclass(frozen=True)
class Airfoil:
    """NACA four-digit section; p runs along the chord, +p at the leading edge, q is up.

    `a` is half the chord; thickness, camber and edge (the extra thickness of an ellipse, which
    rounds the trailing edge) are fractions of the chord; the camber's crest is `crest` of the
    chord behind the leading edge.
    """

    a: Curve
    thickness: Curve = 0.12
    camber: Curve = 0.0
    crest: float = 0.4
    edge: float = 0.006

    def half_width(self, s: Array) -> Array | float:
        return at(self.a, s)

    def _camber_thickness(self, xi: Array, s: Array) -> tuple[Array, Array]:
        """Camber line and half-thickness, in units of length, at p = xi * a."""
        x = np.clip((1 - xi) / 2, 0, 1)
        chord = 2 * at(self.a, s)
        half = 5 * at(self.thickness, s) * (
            0.2969 * np.sqrt(x) - x * (0.1260 + x * (0.3516 - x * (0.2843 - 0.1036 * x)))
        ) + self.edge * np.sqrt(x * (1 - x))
        m, c = at(self.camber, s), self.crest
        front = (2 * c * x - x * x) / c**2
        rear = (1 - 2 * c + 2 * c * x - x * x) / (1 - c) ** 2
        return chord * m * np.where(x < c, front, rear), chord * half

    def disc(self, u: Array, rho: Array, s: Array) -> tuple[Array, Array]:
        xi = np.cos(2 * np.pi * u)
        camber, half = self._camber_thickness(xi, s)
        side = np.where(np.sin(2 * np.pi * u) >= 0, 1.0, -1.0)
        return at(self.a, s) * xi, camber + rho * side * half

    def inside(self, p: Array, q: Array, s: Array) -> NDArray[np.bool_]:
        xi = p / np.maximum(at(self.a, s), TINY)
        camber, half = self._camber_thickness(xi, s)
        return (np.abs(xi) <= 1) & (np.abs(q - camber) <= half)

    def chord(self, xi: Array, s: Array) -> tuple[Array, Array]:
        camber, half = self._camber_thickness(xi, s)
        return camber - half, camber + half
