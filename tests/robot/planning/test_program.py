from __future__ import annotations

import itertools

import numpy as np
import pytest

from nrdf.robot.model.cell import Placement
from nrdf.robot.planning.joint_path_planner import plan_joint_paths
from nrdf.robot.planning.program import ProgramPlanner, find_home
from nrdf.robot.planning.timing import STEP_S

UPRIGHT = np.eye(3)[[2, 0, 1]]


def test_home_is_far_from_the_object_at_every_angle(wall):
    home = find_home(wall.cell, wall.library)
    frames = wall.cell.chain.frames(home[None])
    assert wall.cell.clearance(frames, np.zeros(1, int)).least[0] > 0.05


def test_a_program_goes_from_home_to_home_without_a_jump(wall, wall_paths):
    home = find_home(wall.cell, wall.library)
    rng = np.random.default_rng(0)
    planner = ProgramPlanner(wall.cell, wall.path.groups, home, wall.library, rng)
    program = planner.program(wall_paths[0])
    assert len(program.joint_paths) == len(program.given) == len(wall_paths[0])
    kinds = [action.kind for action in program.actions]
    assert kinds[:2] == ["turntable", "transition"] and kinds[-1] == "transition"
    assert kinds.count("process") == len(program.joint_paths)
    for kind, after in itertools.pairwise(kinds):
        assert {"approach": "process", "process": "retract"}.get(kind, after) == after
    ends = [action.timed.joints[[0, -1]] for action in program.actions]
    np.testing.assert_allclose([ends[0][0], ends[-1][-1]], [home, home], atol=1e-9)
    for before, after in itertools.pairwise(ends):
        np.testing.assert_allclose(before[1], after[0], atol=1e-9)
    again = planner.program(wall_paths[0])
    assert all(one is other for one, other in zip(program.actions, again.actions, strict=True))


def test_the_feed_and_the_force_are_the_segments(wall, wall_paths):
    home = find_home(wall.cell, wall.library)
    rng = np.random.default_rng(0)
    planner = ProgramPlanner(wall.cell, wall.path.groups, home, wall.library, rng)
    actions = planner.program(wall_paths[0]).actions
    longest = max((a for a in actions if a.kind == "process"), key=lambda a: len(a.timed.joints))
    assert longest.force_n == 10.0 and {a.force_n for a in actions} == {10.0, None}
    length = (
        np.ptp(wall.path.segments[0].positions[:, 0]) * (len(longest.timed.feed_share) - 1) / 11
    )
    assert len(longest.timed.joints) * STEP_S == pytest.approx(length / 0.1, rel=0.4)


def test_the_turntable_turns_the_shorter_way_while_the_arm_is_at_home(wall):
    placement = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0, 1.5 * np.pi))
    cell = wall.cell.with_placement(placement, UPRIGHT)
    paths, _, _ = plan_joint_paths(cell, wall.library, wall.path.groups)
    home = find_home(cell, wall.library)
    planner = ProgramPlanner(cell, wall.path.groups, home, wall.library, np.random.default_rng(0))
    move = planner._turntable_move(0, 1)
    assert paths and move.kind == "turntable"
    assert move.angles_rad[-1] == pytest.approx(1.5 * np.pi) and move.angles_rad[0] > 1.5 * np.pi
    assert len(move.angles_rad) * STEP_S == pytest.approx(2.0, abs=0.01)
    np.testing.assert_array_equal(move.timed.joints, np.tile(home, (len(move.angles_rad), 1)))
