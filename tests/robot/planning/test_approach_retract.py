from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.arm_cells import path_of
from nrdf.robot.planning.approach_retract import (
    add_approach_retract,
    approach_positions,
    lengthen,
    retract_positions,
)
from nrdf.toolpath.types import Segment, SegmentGroup

PROCESS = path_of().segments[0]


def heights(wall, joints, path):
    """How far above the plate's top the tool is."""
    pose = wall.cell.T_base_object[path.turntable_index]
    return ((wall.cell.chain.frames(joints).tcp - pose[:3, 3]) @ pose[:3, :3])[:, 1] - 0.03


def test_without_a_free_move_the_tool_comes_and_goes_along_its_axis():
    group = SegmentGroup(None, PROCESS, None)
    into, out = approach_positions(group), retract_positions(group)
    np.testing.assert_allclose(into[0], [0.0, 0.23, 0.0], atol=1e-12)
    np.testing.assert_allclose(out[-1], [0.05, 0.23, 0.0], atol=1e-12)
    # The surface itself is no part of them.
    assert into[-1, 1] > 0.205 and out[0, 1] > 0.205


def test_the_tool_paths_own_free_moves_are_walked_evenly():
    turned = PROCESS.quaternions_xyzw
    corners = np.array([[0.0, 0.3, 0.1], [0.0, 0.2, 0.0]])
    group = SegmentGroup(
        Segment("approach", 0, corners, turned, 0.2), PROCESS,
        Segment("retract", 0, corners[::-1] + np.array([0.05, 0, 0]), turned, 0.2),
    )  # fmt: skip
    into, out = approach_positions(group), retract_positions(group)
    np.testing.assert_allclose(into[0], corners[0])
    np.testing.assert_allclose(out[::-1] - [0.05, 0, 0], into, atol=1e-12)
    steps = np.linalg.norm(np.diff(into, axis=0), axis=1)
    assert np.ptp(steps) < 1e-9 and steps[0] <= 0.012 + 1e-9


def test_joint_paths_come_from_above_and_leave_upwards(wall, wall_paths):
    path = replace(wall_paths[0][0], approach=np.zeros((0, 6)), retract=np.zeros((0, 6)))
    (made,) = add_approach_retract(wall.cell, wall.path.groups, [path])
    assert made is not None
    into, out = heights(wall, made.approach, path), heights(wall, made.retract, path)
    assert (np.diff(into) < 0.0).all() and (np.diff(out) > 0.0).all()
    assert into[-1] > 0.002 and out[0] > 0.002


def test_a_tool_that_cannot_leave_the_surface_has_no_joint_path(wall, wall_paths):
    path = wall_paths[0][0]
    segment = wall.path.groups[0].process
    deep = SegmentGroup(None, replace(segment, positions=segment.positions - [0, 5.0, 0]), None)
    assert add_approach_retract(wall.cell, [deep], [path]) == [None]


@pytest.mark.parametrize("start", [True, False])
def test_a_longer_free_move_begins_or_ends_higher(wall, wall_paths, start):
    path = wall_paths[0][0]
    longer = lengthen(wall.cell, path, start)
    row = 0 if start else -1
    before = heights(wall, path.whole()[row][None], path)
    assert heights(wall, longer.whole()[row][None], path) > before + 0.05
    kept = "retract" if start else "approach"
    np.testing.assert_array_equal(getattr(longer, kept), getattr(path, kept))
