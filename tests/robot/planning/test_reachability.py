from __future__ import annotations

import numpy as np

from nrdf.robot.planning.inverse_kinematics import LEAST_CLEARANCE_M, pose_errors
from nrdf.robot.planning.reachability import solve_everywhere


def test_a_waypoint_on_the_plate_is_reached_and_one_across_the_room_is_not(wall):
    process = wall.path.segments[0]
    positions = np.stack([process.positions[0], [5.0, 0.03, 0.0]])
    found, reachability = solve_everywhere(wall.cell, wall.library, positions, process.axes[:2])
    assert reachability.solved.tolist() == [True, False]
    assert reachability.collision_free.tolist() == reachability.regular.tolist() == [True, False]
    assert len(found.joints) and (found.target == 0).all() and (found.score > 0.0).all()
    frames = wall.cell.chain.frames(found.joints)
    at, along = wall.cell.to_base(
        found.turntable_index, positions[found.target], process.axes[found.target]
    )
    distance, angle = pose_errors(frames, at, along)
    assert distance.max() < 1e-4 and np.degrees(angle.max()) < 0.1
    assert (wall.cell.clearance(frames, found.turntable_index).least > LEAST_CLEARANCE_M).all()


def test_a_pose_inside_the_wall_is_solved_but_not_collision_free(wall):
    process = wall.path.segments[0]
    inside = np.array([[0.115, 0.03, 0.0]])
    _, found = solve_everywhere(wall.cell, wall.library, inside, process.axes[:1])
    assert found.solved.all() and not found.collision_free.any() and not found.regular.any()
