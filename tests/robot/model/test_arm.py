from __future__ import annotations

import numpy as np
import pytest

from builders.sent_files import six_axis_urdf
from nrdf.errors import RobotError
from nrdf.robot.model.arm import BUNDLED, load_arm


def test_the_bundled_arm_has_a_ur10es_reach_and_limits(arm):
    # Universal Robots' published parameters: stretched out along -x, the flange is there.
    tip = arm.chain.frames(np.zeros((1, 6))).tcp[0]
    np.testing.assert_allclose(tip, [-1.18425, -0.2907, 0.06085], atol=1e-4)
    np.testing.assert_allclose(
        np.degrees(arm.chain.speeds), [120, 120, 180, 180, 180, 180], atol=0.1
    )
    assert np.degrees(arm.chain.upper[2]) == pytest.approx(180, abs=0.1)


def test_a_tool_frame_that_does_not_exist_lists_those_that_do():
    with pytest.raises(RobotError, match="no tool frame 'tcp'; known: flange, base, shoulder"):
        load_arm(BUNDLED, "tcp")


def test_an_arm_of_too_few_axes():
    with pytest.raises(RobotError, match=r"3 axes \(shoulder_pan, shoulder_lift, elbow\) lead to"):
        load_arm(BUNDLED, "forearm")


def test_a_urdf_keeps_its_speed_limits_and_says_which_meshes_are_missing(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(six_axis_urdf())
    arm = load_arm(file)
    assert arm.joint_names == tuple(f"j{i}" for i in range(6))
    np.testing.assert_allclose(arm.chain.speeds, 1.5)
    assert any("1 meshes of arm.urdf are not there" in line for line in arm.warnings)
