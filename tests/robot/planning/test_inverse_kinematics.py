from __future__ import annotations

import numpy as np

from nrdf.robot.planning.inverse_kinematics import (
    SeedLibrary,
    damped_least_squares_step,
    null_space_gradient,
    pose_errors,
    solve,
)


def test_inverse_kinematics_reach_what_the_arm_can_reach(cell):
    rng = np.random.default_rng(2)
    frames = cell.chain.frames(rng.uniform(-2, 2, (40, 6)))
    targets, axes = frames.tcp, frames.tool[:, :, 2]
    library = SeedLibrary.build(cell, 8000, rng)
    joints = library.nearest(targets, axes, 6).reshape(240, 6)
    joints, good = solve(cell.chain, joints, targets.repeat(6, axis=0), axes.repeat(6, axis=0))
    away, angle = pose_errors(
        cell.chain.frames(joints), targets.repeat(6, axis=0), axes.repeat(6, axis=0)
    )
    assert good.reshape(40, 6).any(axis=1).mean() > 0.9
    assert away[good].max() < 1e-4
    assert np.degrees(angle[good].max()) < 0.1


def test_a_target_out_of_reach_is_not_reached(cell):
    far = np.array([[3.0, 0.0, 0.0]])
    assert not solve(cell.chain, np.zeros((1, 6)), far, np.array([[0.0, 0.0, -1.0]]))[1].any()


STILL = np.array([[0.3, -1.2, 1.4, -1.0, -1.5, 0.2]])


def test_the_null_space_is_followed_without_leaving_the_target(cell):
    frames = cell.chain.frames(STILL)
    target = frames.tcp, frames.tool[:, :, 2]
    gradient = 0.01 * np.ones((1, 6))
    moved = damped_least_squares_step(cell.chain, frames, STILL, *target, gradient)
    assert np.abs(moved - STILL).max() > 1e-3
    distance, angle = pose_errors(cell.chain.frames(moved), *target)
    assert distance[0] < 1e-3 and angle[0] < 2e-3


def test_the_gradient_leads_away_from_joint_limits(cell):
    joints = STILL.copy()
    joints[0, 2] = cell.chain.upper[2] - 0.01
    frames = cell.chain.frames(joints)
    gradient = null_space_gradient(cell, frames, joints, cell.clearance(frames, np.zeros(1, int)))
    other = null_space_gradient(
        cell, (still := cell.chain.frames(STILL)), STILL, cell.clearance(still, np.zeros(1, int))
    )
    assert gradient[0, 2] < min(other[0, 2], 0.0)
