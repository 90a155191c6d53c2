"""Spacing of lines whose spacing is known: a plate with rows a stepover of 25 mm apart."""

from __future__ import annotations

import numpy as np
import pytest

from builders.mesh_targets import PLATE
from nrdf_benchmark.mesh_paths.line_spacing import Line, line_spacing

ROWS = 0.025 * np.arange(10)
STEP = 0.025


def line(points) -> Line:
    points = np.array(points, dtype=float)
    return Line.of(points, np.tile([0.0, 0.0, -1.0], (len(points), 1)), PLATE)


def row(y: float, first: float = 0.0, last: float = 0.4) -> Line:
    return line([[x, y, 0.0] for x in np.linspace(first, last, 41)])


def spacing(lines, hole: float = 0.0) -> np.ndarray:
    def surface(places: np.ndarray, outward: np.ndarray) -> np.ndarray:
        assert (outward[:, 2] > 0.9).all()
        return np.abs(places[:, :2] - [0.2, 0.1]).max(axis=1) >= hole

    return line_spacing(lines, STEP, surface) / STEP


def test_exact_rows_are_one_stepover_apart_everywhere():
    found = spacing([row(y) for y in ROWS])
    assert len(found) > 500
    np.testing.assert_allclose(found, 1.0, atol=1e-9)


@pytest.mark.parametrize("round_corners", [False, True])
def test_rows_joined_to_a_zigzag_are_still_one_stepover_apart(round_corners):
    corners = []
    for k, y in enumerate(ROWS):
        ends = [[0.0, y, 0.0], [0.4, y, 0.0]]
        corners += ends if k % 2 == 0 else ends[::-1]
    if round_corners:  # the way from row to row is a half circle
        points = []
        for k, y in enumerate(ROWS):
            side = 1 if k % 2 == 0 else -1
            x = np.linspace(0.0, 0.4, 41)[::side]
            points += [[a, y, 0.0] for a in x]
            if k < 9:
                turn = np.linspace(-np.pi / 2, np.pi / 2, 12)[1:-1]
                points += [
                    [x[-1] + side * 0.0125 * np.cos(t), y + 0.0125 + 0.0125 * np.sin(t), 0.0]
                    for t in turn
                ]
        corners = points
    found = spacing([line(corners)])
    assert len(found) > 500
    assert ((found > 0.85) & (found < 1.15)).mean() > 0.99
    assert found.max() < 1.3


def test_a_line_that_is_missing_is_a_gap():
    found = spacing([row(y) for y in np.delete(ROWS, 4)])
    assert found.max() == pytest.approx(2.0)
    assert 0.08 < (found > 1.15).mean() < 0.2  # of nine pairs of neighbours one


@pytest.mark.parametrize(("share", "widest"), [(0.45, 1.0), (1.0, 1.0), (1.5, 1.5), (3.0, 2.0)])
def test_a_break_is_as_wide_as_the_disc_that_fits_into_it(share, widest):
    half = 0.5 * share * STEP
    broken = [row(ROWS[4], 0.0, 0.2 - half), row(ROWS[4], 0.2 + half, 0.4)]
    found = spacing([row(y) for y in np.delete(ROWS, 4)] + broken)
    assert found.max() == pytest.approx(widest, abs=0.02)


def test_what_a_hole_parts_are_no_neighbours():
    lines = [row(y) for y in np.delete(ROWS, 4)]
    lines += [row(ROWS[4], 0.0, 0.18), row(ROWS[4], 0.22, 0.4)]
    assert spacing(lines).max() == pytest.approx(1.6, abs=0.02)
    assert spacing(lines, hole=0.022).max() == pytest.approx(1.0)
    lines = [row(y) for y in np.delete(ROWS, 4)]  # the hole excuses only what it is
    assert spacing(lines, hole=0.022).max() == pytest.approx(2.0)


def test_ways_from_row_to_row_are_no_rows():
    zigzag = []
    for k, y in enumerate(ROWS):
        ends = [[0.0, y, 0.0], [0.4, y, 0.0]]
        zigzag += ends if k % 2 == 0 else ends[::-1]
    beside = line([[0.412, y, 0.0] for y in np.linspace(0.0, 0.2, 30)])
    found = spacing([line(zigzag), beside])
    np.testing.assert_allclose(found, 1.0, atol=1e-6)


def test_rows_that_meet_at_an_angle_are_no_neighbours_and_doubled_ones_are():
    rows = [row(y) for y in ROWS]
    meeting = line([[0.1 + 0.03 * t, 0.02 * t, 0.0] for t in np.linspace(-0.6, 0.9, 30)])
    assert spacing([*rows, meeting]).min() > 0.85
    doubled = spacing([*rows, row(0.1 * STEP + ROWS[4] + 0.4 * STEP)])
    assert (doubled < 0.85).mean() > 0.1


def test_a_few_places_beside_each_other_are_no_rows():
    lines = [row(0.0), row(1.0), line([[0.0, 0.02, 0.0], [0.006, 0.02, 0.0]])]
    assert len(spacing(lines)) == 0
