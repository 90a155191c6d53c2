"""What a footprint passes over along a path that is sampled densely."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.toolpath.sampled_path import SampledPath, reached_points

DOWN = np.array([0.0, 0.0, -1.0])


def straight(*levels, length=0.3):
    x = np.linspace(0.0, length, 16)
    lines = [np.stack([x, np.full(16, y), np.zeros(16)], axis=1) for y in levels]
    return SampledPath.along(lines, [np.tile(DOWN, (16, 1))] * len(levels), 0.005, 0.01)


def test_samples_are_even_and_lines_are_far_apart_along_the_way():
    sampled = straight(0.0, 0.1)
    steps = np.diff(sampled.arc_length)
    assert np.sort(steps)[-1] > 100.0  # from line to line
    assert np.sort(steps)[:-1] == pytest.approx(0.005, rel=0.02)
    np.testing.assert_allclose(sampled.travel, np.tile([1.0, 0.0, 0.0], (len(sampled.places), 1)))


def test_a_point_is_counted_once_a_passage():
    points = np.array([[0.15, y, 0.0] for y in (0.0, 0.02, 0.05, 0.09)])
    up = np.tile(-DOWN, (4, 1))
    counts = straight(0.0, 0.03, 0.06).coverage_count(points, up, 0.025)
    assert counts.tolist() == [1, 2, 2, 0]
    assert straight(0.0).coverage_count(points[:0], up[:0], 0.025).shape == (0,)


def test_the_other_side_is_not_reached():
    points, outward = np.array([[0.1, 0.0, 0.0]] * 2), np.array([[0, 0, 1.0], [0, 0, -1.0]])
    sampled = straight(0.0)
    found = reached_points(points, outward, sampled.places, sampled.axes, 0.025)
    assert found.tolist() == [True, False]
    assert not reached_points(points, outward, points[:0], points[:0], 0.025).any()
