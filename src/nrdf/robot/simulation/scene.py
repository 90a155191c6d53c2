"""A MuJoCo model of the cell: the arm with its motors, the tool with its force sensor."""

from __future__ import annotations

from typing import Any

import numpy as np

from nrdf.geometry.frames import quaternions_wxyz
from nrdf.robot.model.cell import Cell
from nrdf.robot.model.mujoco_model import mujoco
from nrdf.robot.model.tool import Tool
from nrdf.robot.planning.timing import STEP_S

STIFFNESS_1_S = 80.0
"""Natural frequency of the joints' position controllers, rad/s; critically damped."""
_DENSITY = 900.0  # of the tool, kg/m³
_COLOURS = {
    "force sensor": (0.20, 0.21, 0.24, 1.0),
    "pad": (0.90, 0.45, 0.10, 1.0),
    "holder": (0.35, 0.35, 0.38, 1.0),
}
_LOAD_RADIUS_M, _LEAST_KG = 0.05, 0.05
"""A tool whose mass is known turns like a ball of that size."""
_TOOL, _SENSOR, _FORCE = "nrdf_tool", "nrdf_sensor", "nrdf_force"


def cell_specification(cell: Cell) -> Any:
    """The arm's specification with motors, tool, sensor and floor, in the frame of its base."""
    spec = cell.arm.spec.copy()
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    # Collisions are checked at every step against the object's distance field instead.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    spec.compiler.boundmass, spec.compiler.boundinertia = 0.05, 1e-4
    for body in spec.bodies[1:]:
        body.gravcomp = 1.0
    _mount(spec.body(cell.arm.body), cell.arm.T_body_flange, cell.tool)
    sensor = spec.add_sensor(name=_FORCE, type=mujoco.mjtSensor.mjSENS_FORCE)
    sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_SITE, _SENSOR
    _add_motors(spec, cell)
    return spec


def _mount(body: Any, T_body_flange: np.ndarray, held: Tool) -> None:
    tool = body.add_body(name=_TOOL, pos=T_body_flange[:3, 3], gravcomp=1.0)
    tool.quat = quaternions_wxyz(T_body_flange[:3, :3])
    tool.add_site(name=_SENSOR)
    if held.load is not None:
        tool.explicitinertial = True
        tool.mass, tool.ipos = held.load
        tool.inertia = np.full(3, 0.4 * max(tool.mass, _LEAST_KG) * _LOAD_RADIUS_M**2)
    for part in held.parts:
        kind = mujoco.mjtGeom.mjGEOM_CYLINDER if part.flat else mujoco.mjtGeom.mjGEOM_CAPSULE
        tool.add_geom(
            name=f"nrdf_{part.name.replace(' ', '_')}",
            type=kind,
            fromto=np.concatenate([part.start, part.end]),
            size=[part.radius, 0.0, 0.0],
            density=_DENSITY,
            rgba=_COLOURS.get(part.name, (0.55, 0.57, 0.60, 1.0)),
        )


def _add_motors(spec: Any, cell: Cell) -> None:
    """Position controllers as stiff as the arm's own inertia allows, with speed fed forward."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    for name in cell.arm.joint_names:
        address = model.jnt_dofadr[model.joint(name).id]
        inertia = max(float(mass[address, address]), 0.4)
        stiff = STIFFNESS_1_S**2 * inertia
        motor = spec.add_actuator(name=f"nrdf_{name}", target=name)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        motor.gainprm[0] = stiff
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        motor.biasprm[1], motor.biasprm[2] = -stiff, -2.0 * STIFFNESS_1_S * inertia


class SimulatedArm:
    """The arm in MuJoCo: commanded joints in, true joints and the sensor's force out."""

    def __init__(self, cell: Cell, start: np.ndarray) -> None:
        self.cell = cell
        self.model = cell_specification(cell).compile()
        self.data = mujoco.MjData(self.model)
        ids = [self.model.joint(name).id for name in cell.arm.joint_names]
        self._position = self.model.jnt_qposadr[ids]
        self._speed = self.model.jnt_dofadr[ids]
        self._motor = [self.model.actuator(f"nrdf_{name}").id for name in cell.arm.joint_names]
        gain = self.model.actuator_gainprm[self._motor, 0]
        self._lead = -self.model.actuator_biasprm[self._motor, 2] / gain
        self._wanted, self._torque = np.zeros(self.model.nv), np.zeros(self.model.nv)
        self._tool = self.model.body(_TOOL).id
        self._site = self.model.site(_SENSOR).id
        T = cell.tool.T_flange_tcp
        self._tip, self._axis = T[:3, 3].copy(), T[:3, 2].copy()
        self._weight = float(self.model.body_mass[self._tool]) * np.array([0.0, 0.0, 9.81])
        self.start(start)

    def start(self, joints: np.ndarray) -> None:
        """Be at rest at joints (n,)."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._position] = joints
        mujoco.mj_forward(self.model, self.data)

    @property
    def joints(self) -> np.ndarray:
        """The true joints (n,)."""
        return np.asarray(self.data.qpos[self._position])

    def tip(self) -> tuple[np.ndarray, np.ndarray]:
        """The tool centre point and the tool's axis (3,), in the base's frame."""
        rotation = self.data.xmat[self._tool].reshape(3, 3)
        return self.data.xpos[self._tool] + rotation @ self._tip, rotation @ self._axis

    def force(self, axis: np.ndarray) -> float:
        """What the sensor measures along the tool's axis (3,), N, without the tool's weight."""
        rotation = self.data.site_xmat[self._site].reshape(3, 3)
        return float(axis @ (rotation @ self.data.sensordata[:3] - self._weight))

    def step(
        self,
        joints: np.ndarray,
        speeds: np.ndarray,
        accelerations: np.ndarray,
        push: np.ndarray | None,
        tip: np.ndarray,
    ) -> None:
        """One step towards commanded joints (n,), their inertia fed forward.

        push: (3,) N, what the surface does to the tool at its tip (3,); None where it touches
        nothing.
        """
        data = self.data
        data.ctrl[self._motor] = joints + self._lead * speeds
        self._wanted[self._speed] = accelerations
        mujoco.mj_mulM(self.model, data, self._torque, self._wanted)
        self._wanted[self._speed] = speeds
        # The joints' own friction is known, and fed forward as well.
        data.qfrc_applied[:] = self._torque + self.model.dof_damping.ravel() * self._wanted
        applied = data.xfrc_applied[self._tool]
        if push is None:
            applied[:] = 0.0
        else:
            arm = tip - data.xipos[self._tool]
            applied[:3] = push
            applied[3] = arm[1] * push[2] - arm[2] * push[1]
            applied[4] = arm[2] * push[0] - arm[0] * push[2]
            applied[5] = arm[0] * push[1] - arm[1] * push[0]
        mujoco.mj_step(self.model, data)
