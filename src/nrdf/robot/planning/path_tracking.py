"""The arm's next step to a waypoint, from where it is, without a jump of configuration.

Where the planned tool axis is blocked, the axis may tilt: a soft round pad works as well a few
degrees off, and that often clears what stands beside the surface.
"""

from __future__ import annotations

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import (
    AXIS_RAD,
    LEAST_CLEARANCE_M,
    LEAST_SINGULAR,
    POSITION_M,
    damped_least_squares_step,
    null_space_gradient,
    pose_errors,
    singular_values,
)

_STEP_RAD, _STEP_SHARE = 0.25, 2.0
"""Between neighbouring waypoints joints may move by the first and that many times the angle by
which the tool's axis turns and, 0.3 m a radian, the position moves; more is a jump to another
configuration."""
_ITERATIONS = 5
TILT_SHARES = (0.5, 1.0)
"""Shares of the tool's largest tilt that are tried where the planned axis is blocked, the smaller
first."""
_TILT_DIRECTIONS = 8


def advance(
    cell: Cell,
    turntable_index: np.ndarray,
    joints: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Joints (b, n) at the next targets, from those at the last ones and those before, and whether
    (b,) the arm gets there without a jump, a collision or a singularity."""
    chain = cell.chain
    at, along = cell.to_base(turntable_index, positions, axes)
    frames = chain.frames(joints)
    gradient = null_space_gradient(cell, frames, joints, cell.clearance(frames, turntable_index))
    moved = np.clip(joints + np.clip(joints - before, -0.1, 0.1), chain.lower, chain.upper)
    good = np.zeros(len(joints), bool)
    for k in range(_ITERATIONS):
        todo = np.flatnonzero(~good)
        frames = chain.frames(moved[todo])
        if k:
            distance, angle = pose_errors(frames, at[todo], along[todo])
            arrived = (distance < POSITION_M) & (angle < AXIS_RAD)
            good[todo[arrived]] = True
            if k + 1 == _ITERATIONS or arrived.all():
                break
            todo, frames = todo[~arrived], chain.frames(moved[todo[~arrived]])
        moved[todo] = damped_least_squares_step(
            chain, frames, moved[todo], at[todo], along[todo], gradient[todo] if k == 0 else None
        )
    distance, angle = pose_errors(chain.frames(joints), at, along)
    allowed = _STEP_RAD + _STEP_SHARE * (angle + distance / 0.3)
    good &= np.abs(moved - joints).max(axis=1) < allowed
    frames = chain.frames(moved)
    good &= cell.clearance(frames, turntable_index).least > LEAST_CLEARANCE_M
    good &= singular_values(frames) > LEAST_SINGULAR
    if good.any():
        left = np.flatnonzero(good)
        good[left] = cell.self_clearance(chain.frames(moved[left])) > LEAST_CLEARANCE_M
    return moved, good


def tilted_axes(axes: np.ndarray, angle: float, directions: int = _TILT_DIRECTIONS) -> np.ndarray:
    """Axes (b, directions, 3) tilted by an angle, rad, from axes (b, 3), evenly all around."""
    helper = np.eye(3)[np.abs(axes).argmin(axis=1)]
    one = np.cross(axes, helper)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(axes, one)
    around = np.arange(directions) * 2.0 * np.pi / directions
    aside = np.cos(around)[:, None] * one[:, None] + np.sin(around)[:, None] * other[:, None]
    return np.asarray(np.cos(angle) * axes[:, None] + np.sin(angle) * aside)


def advance_tilted(
    cell: Cell,
    turntable_index: np.ndarray,
    joints: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `advance`, the tool axis tilted where it must be; also the axes (b, 3) it has then."""
    moved, good = advance(cell, turntable_index, joints, before, positions, axes)
    used = axes.copy()
    for share in TILT_SHARES:
        failed = np.flatnonzero(~good)
        if not len(failed):
            break
        tried = tilted_axes(axes[failed], share * cell.tool.max_tilt_rad)
        many = failed.repeat(_TILT_DIRECTIONS)
        found, clear = advance(
            cell, turntable_index[many], joints[many], before[many], positions[many],
            tried.reshape(-1, 3),
        )  # fmt: skip
        clear = clear.reshape(len(failed), _TILT_DIRECTIONS)
        # Of the directions that are clear the middle one: farthest from what is in the way.
        middle = np.einsum("bk,bka->ba", clear, tried)
        closeness = np.where(clear, np.einsum("bka,ba->bk", tried, middle), -np.inf)
        best, row = closeness.argmax(axis=1), np.arange(len(failed))
        found = found.reshape(len(failed), _TILT_DIRECTIONS, -1)[row, best]
        some = clear.any(axis=1)
        done = failed[some]
        moved[done], used[done], good[done] = found[some], tried[row, best][some], True
    return moved, good, used


def advance_free(
    cell: Cell,
    turntable_index: np.ndarray,
    joints: np.ndarray,
    moves: list[np.ndarray],
    axes: np.ndarray,
) -> list[np.ndarray]:
    """Joints (k, n) along free moves (k, 3) from the surface, each as far as it is clear."""
    solved: list[list[np.ndarray]] = [[] for _ in moves]
    active = np.arange(len(moves))
    before = joints
    step = 0
    while True:
        more = np.array([len(moves[i]) > step for i in active], bool)
        active, joints, before = active[more], joints[more], before[more]
        if not len(active):
            return [np.array(some).reshape(len(some), cell.chain.size) for some in solved]
        position = np.array([moves[i][step] for i in active])
        moved, good = advance(cell, turntable_index[active], joints, before, position, axes[active])
        for i, values, clear in zip(active, moved, good, strict=True):
            if clear:
                solved[i].append(values)
        active, before, joints = active[good], joints[good], moved[good]
        step += 1
