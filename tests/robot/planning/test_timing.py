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
