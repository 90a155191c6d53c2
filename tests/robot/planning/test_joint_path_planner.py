from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from builders.arm_cells import path_of
from nrdf.robot.planning import joint_path_planner
from nrdf.robot.planning.joint_path_planner import fewest_runs, plan_joint_paths


def test_the_tool_tilts_away_from_a_wall_and_only_there(wall, wall_paths):
    paths, covered, _ = wall_paths
    assert covered[0].all()
    tilt = np.zeros(12)
    for path in paths:
        planned = wall.path.segments[0].axes[path.first : path.last + 1]
        cosine = (path.axes * planned).sum(axis=1)
        tilt[path.first : path.last + 1] = np.arccos(np.clip(cosine, -1.0, 1.0))
    assert (tilt[:10] < 1e-6).all()
    assert 0.01 < tilt[-1] < wall.cell.tool.max_tilt_rad + 1e-6
    tail = -next(path for path in paths if path.last == 11).axes[-1]
    assert tail[0] < -0.01


def test_why_a_waypoint_is_not_covered(wall):
    far = path_of(((5.0, 0.03, 0.0), (5.05, 0.03, 0.0)))
    paths, covered, reachability = plan_joint_paths(wall.cell, wall.library, far.groups)
    assert not paths and not covered[0].any()
    assert not reachability[0].solved.any()


def test_a_gun_s_run_up_is_driven_as_far_as_the_arm_reaches_it(wall):
    """Of 4 waypoints with the gun off before a line of 6, the arm reaches the last one."""
    near = np.linspace(-0.02, 0.03, 6)
    x = np.concatenate([[5.0, 5.1, 5.2], [-0.03], near])
    path = path_of(np.stack([x, np.full(10, 0.03), np.zeros(10)], axis=1), force=None)
    line = replace(path.segments[0], tool_on=np.arange(10) >= 4)
    groups = replace(path, segments=(line,)).groups
    (made,), covered, _ = plan_joint_paths(wall.cell, wall.library, groups)
    assert (made.first, made.last) == (3, 9)
    assert covered[0].all()


def test_inside_a_line_a_gun_goes_on_where_it_went_off(wall, monkeypatch):
    """Joint paths of at most 8 waypoints, as if the arm came no farther."""
    line = replace(wall.path.segments[0], force_n=None, tool_on=np.ones(12, bool))
    groups = replace(wall.path, segments=(line,)).groups
    runs = joint_path_planner._runs

    def short(*args):
        return [(first, min(last, first + 7)) for first, last in runs(*args)]

    monkeypatch.setattr(joint_path_planner, "_runs", short)
    paths, _, _ = plan_joint_paths(wall.cell, wall.library, groups)
    ends = sorted((path.first, path.last) for path in paths)
    assert len(ends) > 1
    assert all(one[1] == other[0] for one, other in itertools.pairwise(ends))


def cheapest(runs, wanted):
    """The least cost by trying every set of runs, each from any of its waypoints to its end."""
    best = float(wanted.sum())
    for size in range(1, len(runs) + 1):
        for some in itertools.combinations(runs, size):
            left = wanted.copy()
            for _, first, last, _ in some:
                left[first : last + 1] = False
            best = min(best, left.sum() + sum(price for *_, price in some))
    return best


@pytest.mark.parametrize("seed", range(20))
def test_no_choice_of_runs_costs_less(seed):
    rng = np.random.default_rng(seed)
    wanted = rng.random(30) < 0.9
    ends = np.sort(rng.integers(0, 30, (6, 2)), axis=1)
    runs = [(k, int(a), int(b), float(rng.uniform(1, 4))) for k, (a, b) in enumerate(ends)]
    chosen = fewest_runs(runs, wanted)
    left, cost = wanted.copy(), 0.0
    for row, first, last in chosen:
        assert runs[row][1] <= first <= last == runs[row][2]
        left[first : last + 1], cost = False, cost + runs[row][3]
    assert cost + left.sum() == pytest.approx(cheapest(runs, wanted))
    assert all(one[2] < other[1] for one, other in itertools.pairwise(chosen))


def test_a_long_line_is_split_once_where_two_runs_overlap():
    runs = [(0, 0, 60, 3.0), (1, 40, 99, 3.0), (2, 20, 80, 3.0)]
    assert fewest_runs(runs, np.ones(100, bool)) == [(0, 0, 60), (1, 61, 99)]
