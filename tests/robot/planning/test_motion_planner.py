from __future__ import annotations

import itertools

import numpy as np
import pytest

from nrdf.robot.planning.motion_planner import Roadmap
from nrdf.robot.planning.program import find_home


@pytest.fixture
def roadmap(wall):
    home = find_home(wall.cell, wall.library)
    return Roadmap(wall.cell, wall.library, 0, home, np.random.default_rng(0))


def test_the_ends_of_a_joint_path_are_connected_to_home_by_free_moves(roadmap, wall_paths):
    whole = wall_paths[0][0].whole()
    start, stop = roadmap.connect(whole[0]), roadmap.connect(whole[-1])
    assert start is not None and stop is not None
    corners = roadmap.path(start, stop)
    np.testing.assert_array_equal(corners[[0, -1]], whole[[0, -1]])
    for one, other in itertools.pairwise(corners):
        assert roadmap.is_free(one, other)


def test_a_move_through_the_object_is_not_free(roadmap, wall, wall_paths):
    joints = wall_paths[0][0].joints[0]
    frames = wall.cell.chain.frames(joints[None])
    lower = joints.copy()
    linear = frames.jacobian()[0][0]
    lower += np.linalg.pinv(linear) @ [0.0, 0.0, -0.12]
    assert not roadmap.is_free(joints, lower)
    assert roadmap.connect(lower) is None


def test_a_random_tree_finds_home(roadmap, wall_paths):
    node = roadmap.connect_by_rrt(wall_paths[0][0].whole()[0])
    assert node is not None
    np.testing.assert_array_equal(roadmap.path(node, 0)[-1], roadmap.nodes[0])
