"""Crevices and other places that a tool cannot access."""

from __future__ import annotations

import numpy as np
import pytest

from builders.solids import box
from nrdf.errors import ProcessError
from nrdf.surface.accessibility import accessible_points
from nrdf.surface.surface import Surface
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.planner import plan
from nrdf.toolpath.strategy import Strategy


def stacked(gap):
    """A box of 0.4 m with a smaller one over half of its top, `gap` above it; the top's points."""
    low, low_normals = box((0.4, 0.2, 0.4), 4000)
    high, high_normals = box((0.2, 0.2, 0.4), 2000, 1, (0.1, 0.2 + gap, 0.0))
    points, normals = np.concatenate([low, high]), np.concatenate([low_normals, high_normals])
    top = np.flatnonzero(low_normals[:, 1] > 0.5)
    return Surface(points, normals), top


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.025])
def test_what_lies_under_another_part_has_no_clearance(gap):
    surface, top = stacked(gap)
    free = accessible_points(surface, top, 0.03)
    x, _, z = np.abs(surface.points[top]).T
    expected = top[surface.points[top, 0] < 0.0]
    at_the_rim = top[(x < 0.01) | (x > 0.19) | (z > 0.19)]
    assert set(free) ^ set(expected) <= set(at_the_rim)


def test_a_thin_part_is_not_stepped_over():
    """A plate from 7 to 11 mm above the top, in the 12 mm that are asked."""
    low, low_normals = box((0.4, 0.2, 0.4), 4000)
    plate, plate_normals = box((0.2, 0.004, 0.4), 8000, 1, (0.1, 0.109, 0.0))
    surface = Surface(np.concatenate([low, plate]), np.concatenate([low_normals, plate_normals]))
    x, _, z = surface.points.T
    top = (np.arange(len(x)) < len(low)) & (surface.normals[:, 1] > 0.5)
    under = np.flatnonzero(top & (x > 0.02) & (x < 0.18) & (np.abs(z) < 0.18))
    beside = np.flatnonzero(top & (x < -0.02))
    free = accessible_points(surface, np.concatenate([under, beside]), 0.012)
    assert np.isin(under, free).mean() < 0.15
    assert np.isin(beside, free).all()


def test_walls_beside_and_gaps_that_are_wide_enough_do_not_matter():
    surface, top = stacked(0.05)
    np.testing.assert_array_equal(accessible_points(surface, top, 0.03), top)
    np.testing.assert_array_equal(accessible_points(surface, top, 0.0), top)
    side = np.flatnonzero(surface.normals[:, 0] < -0.5)
    np.testing.assert_array_equal(accessible_points(surface, side, 1e9), side)


def test_a_plan_keeps_out_and_its_figures_say_how_much():
    surface, top = stacked(0.0)
    strategy = Strategy(tool_radius_m=0.02, stepover_m=0.03, clearance_m=0.03)
    segments = plan(surface, top, strategy)
    work = np.concatenate([s.positions for s in segments if s.kind == "process"])
    assert work[:, 0].max() < 0.01
    metrics = measure_path(surface, top, strategy, segments)
    assert metrics.left_out["no_clearance"] == pytest.approx(0.5, abs=0.03)
    assert metrics.coverage == pytest.approx(0.5, abs=0.03)  # of the whole region
    assert metrics.unreached < 0.01
    assert measure_path(surface, top, Strategy(tool_radius_m=0.02), segments).coverage < 0.65


def test_nowhere_any_room():
    surface, top = stacked(0.0)
    under = top[surface.points[top, 0] > 0.03]
    with pytest.raises(ProcessError, match=r"nowhere in the region are 30 mm free before"):
        plan(surface, under, Strategy(clearance_m=0.03))
