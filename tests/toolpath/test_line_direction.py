"""Which way a region's lines run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import plate, tube
from nrdf.toolpath.line_direction import line_axes, with_direction
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy()
X, Y, Z = np.eye(3)


def test_lines_run_along_the_longest_extent_and_left_is_seen_from_outside():
    along, left = line_axes(plate(), STRATEGY)
    np.testing.assert_allclose(along, X, atol=1e-9)
    np.testing.assert_allclose(left, Y, atol=1e-9)
    along, left = line_axes(plate(0.2, 0.4), STRATEGY)
    np.testing.assert_allclose(along, Y, atol=1e-9)
    np.testing.assert_allclose(left, -X, atol=1e-9)


def test_a_direction_is_brought_onto_the_region():
    along, left = line_axes(plate(), replace(STRATEGY, direction=np.array([0.0, -3.0, 1.0])))
    np.testing.assert_allclose(along, -Y, atol=1e-9)
    np.testing.assert_allclose(left, X, atol=1e-9)


def test_across_is_square_to_what_it_would_be():
    across = replace(STRATEGY, direction_mode="across")
    made = with_direction(plate(), across)
    np.testing.assert_allclose(np.abs(made.direction), Y, atol=1e-9)
    np.testing.assert_allclose(np.abs(with_direction(plate(), made).direction), Y, atol=1e-9)
    given = replace(across, direction=Y)
    np.testing.assert_allclose(np.abs(with_direction(plate(), given).direction), X, atol=1e-9)
    around = with_direction(tube(), across).direction
    assert around @ X == pytest.approx(0.0, abs=1e-6)


def test_the_longest_extent_takes_the_place_of_a_direction_only_if_asked():
    given = replace(STRATEGY, direction=Y)
    assert with_direction(plate(), given) is given
    assert with_direction(plate(), replace(given, direction_mode="principal")).direction is None
