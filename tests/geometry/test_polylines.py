"""Lines in even steps, and how long they are."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.geometry.polylines import (
    arc_length,
    even_arc_lengths,
    interpolate,
    longest_step,
    resample,
    total_length,
)

CORNER = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]])


def test_lengths_of_a_line():
    np.testing.assert_allclose(arc_length(CORNER), [0.0, 3.0, 4.0])
    assert total_length(CORNER) == 4.0
    assert longest_step(CORNER) == 3.0
    assert (arc_length(CORNER[:1]), total_length(CORNER[:1]), longest_step(CORNER[:1])) == (0, 0, 0)


@pytest.mark.parametrize(
    ("spacing", "nearest", "steps"),
    [(1.0, False, 4), (0.9, False, 5), (0.9, True, 4), (9, True, 1)],
)
def test_steps_are_even_and_at_most_or_nearly_the_spacing(spacing, nearest, steps):
    at = even_arc_lengths(4.0, spacing, nearest)
    np.testing.assert_allclose(at, np.arange(steps + 1) * 4.0 / steps)
    assert len(even_arc_lengths(4.0, spacing, nearest, least=7)) == 8


def test_a_resampled_line_keeps_its_ends_and_lies_on_the_line():
    line = resample(CORNER, 0.8)
    np.testing.assert_allclose(line[[0, -1]], CORNER[[0, -1]])
    np.testing.assert_allclose(line[4], [3.0, 0.2, 0.0])
    assert longest_step(line) <= 0.8 + 1e-12


def test_values_are_interpolated_along_the_line():
    values = np.array([[0.0, 10.0], [3.0, 10.0], [3.0, 20.0]])
    found = interpolate(np.array([1.5, 3.5]), arc_length(CORNER), values)
    np.testing.assert_allclose(found, [[1.5, 10.0], [3.0, 15.0]])
