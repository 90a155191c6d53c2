from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.robot.simulation.scene import SimulatedArm

HOME = np.array([0.0, -1.5, 1.5, -1.2, -1.57, 0.0])


def test_the_force_sensor_feels_the_push_and_not_the_weight(cell):
    still = np.array([0.0, -1.5, 1.5, -1.2, -1.57, 0.0])
    machine = SimulatedArm(cell, still)
    for push in (0.0, 20.0):
        for _ in range(300):
            tip, axis = machine.tip()
            machine.step(still, 0 * still, 0 * still, -push * axis, tip)
        assert machine.force(axis) == pytest.approx(push, abs=0.1)


def test_commanded_joints_are_followed(cell):
    start = np.array([0.0, -1.5, 1.5, -1.2, -1.57, 0.0])
    simulated = SimulatedArm(cell, start)
    there = start + 0.05
    for share in np.linspace(0.0, 1.0, 250):
        speeds = np.full(6, 0.05)
        simulated.step(start + share * 0.05, speeds, np.zeros(6), None, simulated.tip()[0])
    for _ in range(100):
        simulated.step(there, np.zeros(6), np.zeros(6), None, simulated.tip()[0])
    np.testing.assert_allclose(simulated.joints, there, atol=1e-3)


@pytest.mark.parametrize("kg", [0.0, 3.0])
def test_the_arm_carries_the_mass_that_the_tool_is_said_to_have(cell, kg):
    there = (0.0, 0.02, 0.05)
    machine = SimulatedArm(replace(cell, tool=replace(cell.tool, load=(kg, there))), HOME)
    tool = machine.model.body("nrdf_tool").id
    assert machine.model.body_mass[tool] == pytest.approx(max(kg, 0.05))
    assert np.allclose(machine.model.body_ipos[tool], there)
