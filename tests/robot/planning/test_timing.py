from __future__ import annotations

import numpy as np
import pytest

from nrdf.robot.planning.timing import STEP_S, time_parameterize


def test_timing_keeps_feed_and_limits(arm):
    joints = np.linspace([0.0] * 6, [0.4] * 6, 21)
    calm = time_parameterize(arm.chain, joints, np.full(20, 0.1))
    assert len(calm.joints) * STEP_S == pytest.approx(2.0, rel=0.2)
    assert (calm.feed_share == 1.0).all()
    hurried = time_parameterize(arm.chain, joints, np.full(20, 0.001))
    assert (np.abs(hurried.speeds) <= arm.chain.speeds * 1.001).all()
    assert (hurried.feed_share[:-1] < 1.0).all()
    np.testing.assert_allclose(hurried.speeds[[0, -1]], 0.0, atol=1e-6)


def test_an_arm_that_stands_still_takes_no_time(arm):
    made = time_parameterize(arm.chain, np.zeros((3, 6)), np.full(2, 1.0))
    assert len(made.joints) == 2 and not made.speeds.any() and not made.slowed.any()


def test_corners_are_rounded_so_that_the_feed_is_kept(arm):
    joints = np.linspace([0.0, -1.2, 1.5, 0.0, 0.5, 0.0], [0.5, -1.2, 1.5, 0.0, 0.5, 0.0], 121)
    joints[1:-1:2, 1] += 4e-4  # as waypoints on a faceted mesh are
    made = time_parameterize(arm.chain, joints, np.full(120, 0.02))
    assert len(made.joints) * STEP_S == pytest.approx(2.4, rel=0.06)
    way, done = (arm.chain.frames(j).tcp for j in (joints, made.joints))
    off = np.linalg.norm(way[None] - done[:, None], axis=2).min(axis=1)
    assert off.max() < 0.003  # half of the way between two waypoints, and the rounding


def test_a_sharp_corner_stays_where_it_is(arm):
    joints = np.zeros((41, 6))
    joints[:, 1], joints[:, 2] = -1.2, 1.5
    joints[:21, 0], joints[20:, 0] = np.linspace(0.0, 0.2, 21), 0.2
    joints[20:, 1] = np.linspace(-1.2, -1.1, 21)
    made = time_parameterize(arm.chain, joints, np.full(40, 0.02))
    corner = arm.chain.frames(joints[20:21]).tcp
    assert np.linalg.norm(arm.chain.frames(made.joints).tcp - corner, axis=1).min() < 0.001
