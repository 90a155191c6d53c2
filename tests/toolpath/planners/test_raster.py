from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from builders.regions_of_shapes import bend, cap, flat_bars, plate, plate_with_hole, tube
from nrdf.errors import ProcessError
from nrdf.geometry.polylines import total_length
from nrdf.toolpath.planners.raster import plan_cross_hatch, plan_raster
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def test_a_plate_has_ten_straight_lines_in_snake_order():
    paths = plan_raster(plate(), STRATEGY)
    assert len(paths) == 10
    for before, after in pairwise(paths):
        assert np.linalg.norm(after.contacts[0] - before.contacts[-1]) < 0.021
    assert all(np.ptp(path.contacts[:, 1]) < 1e-6 for path in paths)


def test_stripes_that_the_users_stepover_leaves_are_not_filled():
    # Four lines 50 mm apart by a tool 24 mm wide, on a plate that is four stepovers wide.
    paths = plan_raster(plate(), replace(STRATEGY, stepover_m=0.05))
    assert len(paths) == 4
    apart = np.diff(sorted(float(path.contacts[:, 1].mean()) for path in paths))
    np.testing.assert_allclose(apart, 0.05, atol=1e-4)


def test_the_direction_is_followed_and_one_that_stands_refused():
    paths = plan_raster(plate(), replace(STRATEGY, direction=np.array([0.0, 2.0, 1.0])))
    assert len(paths) == 20 and all(np.ptp(path.contacts[:, 0]) < 1e-6 for path in paths)
    with pytest.raises(ProcessError, match="stands on the region"):
        plan_raster(plate(), replace(STRATEGY, direction=np.array([0.0, 0.0, 1.0])))


def test_lines_on_a_sphere_are_even_along_it():
    paths = plan_raster(cap(), replace(STRATEGY, direction=np.array([1.0, 0.0, 0.0])))
    # Distance from the middle line's great circle, along the sphere.
    far = [0.2 * np.arcsin(path.contacts[:, 1] / 0.2) for path in paths]
    long = [k for k, path in enumerate(paths) if total_length(path.contacts) > 0.1]
    assert max(np.ptp(far[k]) for k in long) < 0.003
    apart = np.diff(sorted(float(np.mean(far[k])) for k in long))
    assert (apart > 0.85 * 0.02).all() and (apart < 1.15 * 0.02).all()


def test_lines_run_along_a_tube_all_around():
    paths = plan_raster(tube(), STRATEGY)
    assert len(paths) in (9, 10)
    assert min(total_length(path.contacts) for path in paths) > 0.38
    angle = np.sort([np.arctan2(*path.contacts[:, :0:-1].mean(axis=0)) for path in paths])
    apart = 0.03 * np.diff(angle)
    assert ((apart > 0.85 * 0.02) & (apart < 1.15 * 0.02)).mean() >= 0.8


def test_lines_follow_a_bent_rod():
    paths = plan_raster(bend(), STRATEGY)
    length = np.array([total_length(path.contacts) for path in paths])
    assert len(paths) <= 8 and np.median(length) > 0.25


def test_cross_hatch_is_two_rasters():
    paths = plan_cross_hatch(plate_with_hole(), STRATEGY)
    spread = np.array([np.ptp(path.contacts, axis=0)[:2] for path in paths])
    assert ((spread[:, 0] > 0.05) ^ (spread[:, 1] > 0.05)).all()
    assert (spread[:, 0] > 0.35).sum() >= 10 and (spread[:, 1] > 0.25).sum() >= 14


def test_slats_between_rails_are_worked_whatever_the_direction():
    """Lines across a slat would be shorter than the tool: they are left out, so it has its own."""
    rails = [(0.0, 0.0, 0.4, 0.06), (0.0, 0.36, 0.4, 0.06)]
    middles = [0.08, 0.2, 0.32]
    region = flat_bars([*rails, *((x - 0.015, 0.06, 0.03, 0.3) for x in middles)])
    strategy = Strategy(
        stepover_m=0.035, spacing_m=0.01, tool_radius_m=0.03, direction=np.array([1.0, 0.0, 0.0])
    )
    contacts = np.concatenate([path.contacts for path in plan_raster(region, strategy)])
    for x in middles:
        away = np.linalg.norm(contacts[:, :2] - [x, 0.21], axis=1)
        assert away.min() < strategy.tool_radius_m
