from __future__ import annotations

import numpy as np
import pytest

from nrdf.geometry.polyline_corners import resample_with_corners
from nrdf.geometry.polylines import resample, step_lengths


def ring(corners, cut=0.0):
    """A closed line through corners (n, 2), each cut off by `cut` to either side."""
    corners = np.asarray(corners, float)
    before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    ends = [way / np.linalg.norm(way, axis=1)[:, None] for way in (before, after)]
    line = np.stack([corners + cut * ends[0], corners + cut * ends[1]], axis=1).reshape(-1, 2)
    line = np.column_stack([line, np.zeros(len(line))])
    return resample(np.concatenate([line, line[:1]]), 0.01)


SQUARE = [(0, 0), (1, 0), (1, 0.7), (0, 0.7)]


@pytest.mark.parametrize("cut", [0.0, 0.03])
def test_corners_of_a_ring_stay_and_are_sharp(cut):
    points, _ = resample_with_corners(ring(SQUARE, cut), 0.13, closed=True)
    away = [np.linalg.norm(points[:, :2] - corner, axis=1).min() for corner in SQUARE]
    assert max(away) < 0.012
    assert step_lengths(points).max() < 1.5 * 0.13 and step_lengths(points).min() > 0.4 * 0.13
    np.testing.assert_allclose(points[0], points[-1], atol=0.05)


def test_an_open_line_keeps_its_corner_and_its_ends():
    line = resample(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.5]], float), 0.01)
    points, at = resample_with_corners(line, 0.15)
    assert np.linalg.norm(points - [1, 0, 0], axis=1).min() < 0.01
    np.testing.assert_allclose(points[[0, -1]], line[[0, -1]])
    assert at[0] == 0.0 and (np.diff(at) > 0.0).all() and len(at) == len(points)


def test_what_has_no_corner_is_in_even_steps():
    turn = np.linspace(0.0, 2.0 * np.pi, 300)
    circle = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    points, _ = resample_with_corners(circle, 0.2, closed=True)
    steps = step_lengths(points)
    assert np.ptp(steps) < 1e-3 and steps.mean() == pytest.approx(0.2, rel=0.03)
