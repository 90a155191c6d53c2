from __future__ import annotations

import itertools

import numpy as np
import pytest

from builders.arm_cells import path_of
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
