from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.arm_cells import path_of
from nrdf.robot.model.tool import BEND_RAD, tool_of


def test_a_pad_tilts_as_far_as_it_gives():
    tool = tool_of(path_of())
    assert tool.presses
    assert tool.radius_m * np.sin(tool.max_tilt_rad) == pytest.approx(0.002)
    narrow = tool_of(replace(path_of(), tool_radius_m=0.004))
    assert narrow.max_tilt_rad == pytest.approx(np.radians(15.0))


def test_a_tool_that_presses_nothing_is_a_nozzle():
    tool = tool_of(path_of(force=None))
    assert not tool.presses and tool.max_tilt_rad == pytest.approx(np.radians(10.0))
    assert [part.name for part in tool.parts][-1] == "nozzle"


def test_the_neck_is_bent_unless_the_knowledge_gives_the_tool_centre_point():
    bent = tool_of(path_of()).T_flange_tcp
    assert np.arccos(bent[2, 2]) == pytest.approx(BEND_RAD)
    half = np.sqrt(0.5)
    given = replace(path_of(), tcp_m=(0.0, 0.01, 0.12), tcp_quaternion_xyzw=(half, 0.0, 0.0, half))
    T = tool_of(given).T_flange_tcp
    np.testing.assert_allclose(T[:3, 3], [0.0, 0.01, 0.12])
    np.testing.assert_allclose(T[:3, 2], [0, -1, 0], atol=1e-12)


def test_spheres_leave_out_the_pad_which_may_touch():
    tool = tool_of(path_of())
    spheres = tool.spheres(6, np.eye(4))
    along = spheres.centres @ tool.T_flange_tcp[:3, 2]
    tip = tool.T_flange_tcp[:3, 3] @ tool.T_flange_tcp[:3, 2]
    assert (spheres.links == 6).all()
    assert 0.0 < tip - (along + spheres.radii).max() < 0.02
