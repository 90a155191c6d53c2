from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.robot.planning.joint_path import densify


def test_positions_between_waypoints_are_on_the_straight_line(wall, wall_paths):
    path = next(path for path in wall_paths[0] if path.first == 0)
    ((dense, blocked),) = densify(wall.cell, wall.path.groups, [path])
    assert not blocked.any() and len(blocked) == path.last - path.first
    assert len(dense.dense) > 2 * len(path.joints)
    assert dense.waypoint[0] == 0 and dense.waypoint[-1] == path.last - path.first
    own = dense.waypoint % 1.0 == 0.0
    np.testing.assert_array_equal(dense.dense[own], path.joints)
    pose = wall.cell.T_base_object[path.turntable_index]
    tips = (wall.cell.chain.frames(dense.dense).tcp - pose[:3, 3]) @ pose[:3, :3]
    np.testing.assert_allclose(tips[:, 1:], np.tile([0.03, 0.0], (len(tips), 1)), atol=1e-4)
    assert (np.diff(tips[:, 0]) > 0.0).all()


def test_something_between_two_waypoints_blocks_the_way(wall, wall_paths):
    path = max(wall_paths[0], key=lambda p: len(p.joints))
    # The object's plate is raised to where the shaft is, for the same joints.
    cell = wall.cell.shifted(np.array([0.0, 0.15, 0.0]))
    segment = wall.path.groups[0].process
    moved = replace(segment, positions=segment.positions - [0.0, 0.15, 0.0])
    ((_, blocked),) = densify(cell, [replace(wall.path.groups[0], process=moved)], [path])
    assert blocked.all()


def test_a_whole_path_and_its_shift(wall_paths):
    path = wall_paths[0][0]
    whole = path.whole()
    assert len(whole) == len(path.approach) + len(path.dense) + len(path.retract)
    shift = 2.0 * np.pi * np.eye(6)[0]
    np.testing.assert_allclose(path.shifted(shift).whole(), whole + shift)
