from __future__ import annotations

import numpy as np

from nrdf.robot.model.kinematics import Chain


def test_the_jacobian_is_the_derivative_of_the_tip(cell):
    joints = np.random.default_rng(1).uniform(-2, 2, (5, 6))
    moved, _ = cell.chain.frames(joints).jacobian()
    step = 1e-6
    for j in range(6):
        there = cell.chain.frames(joints + step * np.eye(6)[j]).tcp
        slope = (there - cell.chain.frames(joints).tcp) / step
        np.testing.assert_allclose(moved[:, :, j], slope, atol=1e-5)


def test_a_prismatic_joint_slides_along_its_axis_and_a_revolute_one_turns_about_it():
    origins = np.tile(np.eye(4), (2, 1, 1))
    ends = np.array([-3.0, -3.0]), np.array([3.0, 3.0])
    chain = Chain(
        origins, np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]), np.array([False, True]),
        np.eye(4), *ends, np.ones(2),
    )  # fmt: skip
    frames = chain.frames(np.array([[np.pi / 2, 0.5]]))
    np.testing.assert_allclose(frames.tcp, [[0.0, 0.5, 0.0]], atol=1e-12)
    linear, angular = frames.jacobian()
    np.testing.assert_allclose(linear[0], [[-0.5, 0.0], [0.0, 1.0], [0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(angular[0], [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0]], atol=1e-12)


def test_a_tool_moves_the_tool_centre_point_with_the_last_joint(arm):
    T_tool_tcp = np.eye(4)
    T_tool_tcp[:3, 3] = 0.0, 0.0, 0.2
    joints = np.random.default_rng(0).uniform(-2, 2, (3, 6))
    bare, held = arm.chain.frames(joints), arm.chain.with_tool(T_tool_tcp).frames(joints)
    np.testing.assert_allclose(held.tcp, bare.tcp + 0.2 * bare.tool[:, :, 2], atol=1e-12)
