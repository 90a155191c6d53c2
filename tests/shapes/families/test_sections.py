"""Curves along a loft and the cross-sections that it is made of."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.shapes.families.sections import Airfoil, Superellipse, linear, rounded, smooth

S = np.linspace(0, 1, 11)


def test_curves_pass_through_their_knots_without_overshoot() -> None:
    knots, values = [0.0, 0.4, 0.5, 1.0], [1.0, 1.0, 3.0, 3.0]
    for curve in (linear(knots, values), smooth(knots, values)):
        np.testing.assert_allclose(curve(np.array(knots)), values)
        dense = curve(np.linspace(-0.5, 1.5, 200))
        assert dense.min() >= 1.0 - 1e-12 and dense.max() <= 3.0 + 1e-12


def test_rounded_ends_fall_to_nothing_and_square_ones_stay() -> None:
    curve = rounded(2.0, 0.0, 0.2)
    np.testing.assert_allclose(curve(np.array([0.0, 0.5, 0.8, 1.0])), [2, 2, 2, 0])
    assert rounded(2.0, 0.0, 0.2, depth=0.25)(np.ones(1))[0] == pytest.approx(1.5)


@pytest.mark.parametrize("section", [Superellipse(0.4, 0.2), Airfoil(0.5, thickness=0.15)])
def test_the_boundary_parts_inside_from_outside(section) -> None:
    u, s = np.linspace(0.03, 0.97, 40), np.full(40, 0.5)
    for rho, within in ((0.97, True), (1.03, False)):
        p, q = section.disc(u, np.full(40, rho), s)
        assert (section.inside(p, q, s) == within).mean() > 0.95


def test_a_superellipse_of_exponent_two_is_an_ellipse() -> None:
    p, q = Superellipse(0.4, 0.2).disc(S, np.ones(11), S)
    np.testing.assert_allclose((p / 0.4) ** 2 + (q / 0.2) ** 2, 1.0)
    assert (p[0], q[0]) == pytest.approx((0.4, 0.0))
