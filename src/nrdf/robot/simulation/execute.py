"""Execute actions in simulation: a force controller along the tool's axis, and what it measures.

The arm is MuJoCo's, with its inertia, motors and force sensor. The surface pushes on the tool's
soft pad as a spring and damper along the tool's axis, with friction against the travel, where the
object's true mesh is: a shifted object is met where it has been shifted to. The
controller is an admittance: it moves the tool along its axis at a speed in proportion to the error
of the force that the sensor measures (Siciliano et al., Robotics, 2009, chapter 9). How far the pad
reaches between waypoints and over bends is known from the mesh that was planned on, and fed
forward; where the object is not like it, or not there, only the force corrects that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from nrdf.geometry.polylines import step_lengths, summed
from nrdf.robot.model.cell import Cell
from nrdf.robot.model.tool import PAD_GIVE_M
from nrdf.robot.planning.program import Action
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.scene import SimulatedArm
from nrdf.surface.target_mesh import TargetMesh

SETTLED_SHARE, SETTLING_S = 0.1, 1.5
"""The tool waits at a line's start until the force is that close, for at most that long."""
_RESPONSE_S = 0.035  # of the force controller
_FASTEST_M_S = 0.05  # of its correction
_FARTHEST_M = 0.012
_EXPECTED_M = 0.004  # between plan and scan
_DAMPING_S = 0.004  # of the pad, as a share of its stiffness
_FRICTION = 0.2
_SAMPLE_M, _SAMPLE_RAD = 0.003, np.radians(4.0)  # between samples of the surface
_LOST_M = 0.02  # a surface farther from the plan than this does not count
_BEFORE_M = (0.02, 0.006, 0.002)
"""Where it is looked for from: as far before the plan as nothing else stands there."""
_FLATTEST = 0.3  # least cosine between the tool's axis and the surface's inward normal


@dataclass(frozen=True)
class ExecutionLog:
    """What happened during one action, a row for each step.

    joints: (t, n). waypoint: (t,), a number between the joint path's waypoints. working: (t,),
    false while the tool waits for its force, dwells, presses less as it is slow, or is beyond an
    edge. force_n: (t,) that the
    sensor measures. tip, axis: (t, 3) of the tool in the object's planned frame. off_m: (t,) of the
    tip from where it is commanded to be, without the correction along the axis.
    """

    action: Action
    joints: np.ndarray
    waypoint: np.ndarray
    working: np.ndarray
    force_n: np.ndarray
    tip: np.ndarray
    axis: np.ndarray
    off_m: np.ndarray


def execute(
    cell: Cell,
    actions: Sequence[Action],
    surface: TargetMesh,
    planned: TargetMesh,
    shift_m: np.ndarray,
    known: Mapping[int, ExecutionLog] = MappingProxyType({}),
) -> list[ExecutionLog]:
    """Execute actions in simulation.

    surface: the object's true mesh; planned: the one that was planned on, which tells what to
    expect. shift_m: (3,) by which the object is shifted, in its own frame. known: logs of actions,
    by the action's id, that need not be executed again: each action begins at rest, where the one
    before it ends.
    """
    if not actions:
        return []
    arm = SimulatedArm(cell, actions[0].timed.joints[0])
    logs = []
    offset, there = 0.0, True
    for action in actions:
        if id(action) in known:
            logs.append(known[id(action)])
            there = False
            continue
        if not there:
            arm.start(action.timed.joints[0])
            offset, there = 0.0, True
        if action.kind == "process" and action.force_n is not None:
            log, offset = _press(arm, cell, action, surface, planned, shift_m)
        else:
            log, offset = _move(arm, cell, action, offset)
        logs.append(log)
    return logs


@dataclass(frozen=True)
class _Motion:
    """An action at each step: joints, speeds, accelerations (t, n), the tool's positions and axes
    (t, 3) in the base's frame, and the joints' motion for a shift along the axis, (t, n)."""

    joints: np.ndarray
    speeds: np.ndarray
    accelerations: np.ndarray
    positions: np.ndarray
    axes: np.ndarray
    along: np.ndarray

    @staticmethod
    def of(cell: Cell, action: Action) -> _Motion:
        joints, speeds = action.timed.joints, action.timed.speeds
        frames = cell.chain.frames(joints)
        moved, turned = frames.jacobian()
        both = np.concatenate([moved, 0.3 * turned], axis=1)
        axis = frames.tool[:, :, 2]
        wanted = np.concatenate([axis, 0.0 * axis], axis=1)
        square = both @ np.swapaxes(both, 1, 2) + 1e-6 * np.eye(6)
        along = np.einsum("tin,ti->tn", both, np.linalg.solve(square, wanted[..., None])[..., 0])
        accelerations = np.gradient(speeds, STEP_S, axis=0) if len(speeds) > 1 else 0.0 * speeds
        return _Motion(joints, speeds, accelerations, frames.tcp, axis, along)


class _Record:
    def __init__(self, arm: SimulatedArm, steps: int) -> None:
        size = len(arm.joints)
        self.joints = np.zeros((steps, size))
        self.tip, self.axis = np.zeros((steps, 3)), np.zeros((steps, 3))
        self.force, self.off, self.waypoint = np.zeros(steps), np.zeros(steps), np.zeros(steps)
        self.working = np.zeros(steps, bool)
        self.count = 0

    def add(
        self,
        arm: SimulatedArm,
        tip: np.ndarray,
        axis: np.ndarray,
        force: float,
        off: float,
        waypoint: float,
        working: bool,
    ) -> None:
        i = self.count
        self.joints[i], self.tip[i], self.axis[i] = arm.joints, tip, axis
        self.force[i], self.off[i] = force, off
        self.waypoint[i], self.working[i] = waypoint, working
        self.count += 1

    def log(self, cell: Cell, action: Action) -> ExecutionLog:
        kept = slice(0, self.count)
        pose = cell.T_base_object[action.turntable_index]
        tip = (self.tip[kept] - pose[:3, 3]) @ pose[:3, :3]
        return ExecutionLog(
            action, self.joints[kept], self.waypoint[kept], self.working[kept], self.force[kept],
            tip, self.axis[kept] @ pose[:3, :3], self.off[kept],
        )  # fmt: skip


def _move(
    arm: SimulatedArm, cell: Cell, action: Action, offset: float
) -> tuple[ExecutionLog, float]:
    """An action without force; the correction of the line before is taken back meanwhile."""
    motion = _Motion.of(cell, action)
    count = len(motion.joints)
    waits = round(action.dwell_s / STEP_S)
    record = _Record(arm, count + waits)
    off = action.off_surface
    tip, axis = arm.tip()
    for i in [*range(count), *([count - 1] * waits)]:
        offset *= 0.97
        arm.step(
            motion.joints[i] + offset * motion.along[i],
            motion.speeds[i],
            motion.accelerations[i],
            None,
            tip,
        )
        tip, axis = arm.tip()
        away = tip - motion.positions[i]
        away = away - (away @ motion.axes[i]) * motion.axes[i] if offset else away
        working = action.kind == "process" and not (off is not None and off[i])
        record.add(
            arm, tip, axis, 0.0, float(np.sqrt(away @ away)), action.timed.waypoint[i], working
        )
    return record.log(cell, action), 0.0 if abs(offset) < 1e-5 else offset


def _press(
    arm: SimulatedArm,
    cell: Cell,
    action: Action,
    surface: TargetMesh,
    planned: TargetMesh,
    shift_m: np.ndarray,
) -> tuple[ExecutionLog, float]:
    """A joint path under force; its log, and how far along its axis the tool was off at the end."""
    motion = _Motion.of(cell, action)
    count = len(motion.joints)
    most = float(action.force_n or 0.0)
    share = np.ones(count) if action.force_share is None else action.force_share
    stiffness = max(most, 1.0) / PAD_GIVE_M
    gap = _gaps(motion, cell, action, surface, shift_m)
    expected = _expected(_gaps(motion, cell, action, planned, 0.0 * shift_m))
    rising = np.gradient(expected, STEP_S) if count > 1 else 0.0 * expected
    travel = np.gradient(motion.positions, axis=0) if count > 1 else np.zeros((1, 3))
    travel /= np.maximum(np.linalg.norm(travel, axis=1, keepdims=True), 1e-9)
    gain = STEP_S / (_RESPONSE_S * stiffness)
    fastest = _FASTEST_M_S * STEP_S
    settling, dwelling = round(SETTLING_S / STEP_S), round(action.dwell_s / STEP_S)
    record = _Record(arm, count + settling + dwelling)
    # The correction is what the scan predicts, and what the force asks for beyond it.
    correction, before, steady, i, waited, dwelt = -float(expected[0]), 0.0, 0, 0, 0, 0
    # Beyond an edge there is nothing to press on: the tool is held where it was planned.
    off = np.zeros(count, bool) if action.off_surface is None else action.off_surface
    working = bool(off[0])
    tip, axis = arm.tip()
    still = np.zeros(motion.joints.shape[1])
    while True:
        inward, wanted = motion.axes[i], float(share[i] * most)
        away = tip - motion.positions[i]
        depth = float(away @ inward)
        # The spring between the surface and where the pad's face really is.
        sunk = depth - gap[i]
        rate = (sunk - before) / STEP_S
        before = sunk
        push = stiffness * (sunk + _DAMPING_S * rate) if sunk > 0.0 else 0.0
        pushed = None
        if push > 0.0:
            pushed = -push * inward - (_FRICTION * push if working else 0.0) * travel[i]
        moving = working and i < count - 1
        offset = expected[i] + correction
        arm.step(
            motion.joints[i] + offset * motion.along[i],
            motion.speeds[i] + rising[i] * motion.along[i] if moving else still,
            motion.accelerations[i] if moving else still,
            pushed,
            tip,
        )
        tip, axis = arm.tip()
        force = arm.force(axis)
        if not off[i]:
            correction += min(max(gain * (wanted - force), -fastest), fastest)
        correction = min(max(correction, -_FARTHEST_M - expected[i]), _FARTHEST_M - expected[i])
        aside = away - depth * inward
        record.add(
            arm, tip, axis, force, float(np.sqrt(aside @ aside)), action.timed.waypoint[i],
            moving and not off[i] and share[i] == 1.0,
        )  # fmt: skip
        if not working:
            waited += 1
            steady = steady + 1 if abs(force - wanted) < SETTLED_SHARE * most else 0
            working = steady >= 10 or waited >= settling
        elif i < count - 1:
            i += 1
        elif dwelt < dwelling:
            dwelt += 1
        else:
            return record.log(cell, action), offset


def _expected(gap: np.ndarray) -> np.ndarray:
    """How far (t,) the tool must go along its axis to where the surface is; where it is too far to
    be the one that the plan is on, as far as beside there. gap: (t,)."""
    there = np.flatnonzero(np.abs(gap) < _EXPECTED_M)
    if not len(there):
        return np.zeros(len(gap))
    return np.interp(np.arange(len(gap)), there, gap[there])


def _gaps(
    motion: _Motion, cell: Cell, action: Action, surface: TargetMesh, shift_m: np.ndarray
) -> np.ndarray:
    """How far (t,) the shifted object's surface is along the tool's axis from the planned tool."""
    moved, turned = step_lengths(motion.positions), step_lengths(motion.axes)
    walked = summed(moved + _SAMPLE_M / _SAMPLE_RAD * turned)
    samples = np.unique(np.floor(walked / _SAMPLE_M).astype(int), return_index=True)[1]
    samples = np.union1d(samples, [len(walked) - 1])
    pose = cell.T_base_object[action.turntable_index]
    positions = (motion.positions[samples] - pose[:3, 3]) @ pose[:3, :3]
    axes = motion.axes[samples] @ pose[:3, :3]
    found = heights(positions, axes, surface, shift_m)
    averaged = _pad_heights(positions, axes, found, cell.tool.radius_m)
    return np.interp(np.arange(len(walked)), samples, averaged)


def _pad_heights(
    positions: np.ndarray, axes: np.ndarray, found: np.ndarray, radius: float
) -> np.ndarray:
    """Heights (m,) averaged over a soft round pad's width along the path."""
    there = found < _LOST_M
    touched = positions + np.where(there, found, 0.0)[:, None] * axes
    # A part of the path that passes by again later is not under the pad.
    reach = int(2.0 * radius / _SAMPLE_M)
    beside = np.arange(len(found))[:, None] + np.arange(-reach, reach + 1)
    inside = (beside >= 0) & (beside < len(found))
    beside = np.clip(beside, 0, len(found) - 1)
    offset = touched[beside] - positions[:, None]
    along = np.einsum("mka,ma->mk", offset, axes)
    aside = np.sqrt(np.maximum(np.einsum("mka,mka->mk", offset, offset) - along**2, 0.0))
    near = inside & there[beside] & (aside < radius) & (np.abs(along) < _LOST_M)
    weight = np.where(near, np.sqrt(np.maximum(1.0 - (aside / radius) ** 2, 0.0)), 0.0)
    total = weight.sum(axis=1)
    mean = (weight * along).sum(axis=1) / np.maximum(total, 1e-9)
    return np.where(total > 0.0, mean, 1.0)


def heights(
    positions: np.ndarray, axes: np.ndarray, surface: TargetMesh, shift_m: np.ndarray
) -> np.ndarray:
    """How far (m,) along axes (m, 3) from positions (m, 3) the object's surface is, when it is
    shifted, all in its planned frame; 1 m where there is none that faces the tool."""
    found = np.ones(len(positions))
    for before in _BEFORE_M:
        lost = np.flatnonzero(found == 1.0)
        starts = positions[lost] - shift_m - before * axes[lost]
        distances, faces = surface.first_hits(starts, axes[lost])
        facing = -np.einsum("na,na->n", axes[lost], surface.face_normals[faces])
        there = (faces >= 0) & (facing > _FLATTEST) & (distances - before < _LOST_M)
        found[lost[there]] = distances[there] - before
    return found
