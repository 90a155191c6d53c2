"""The arm's next step towards a place, from where it is, without a jump.

Where the planned axis is blocked, the tool may lean: a soft round pad works as well a few degrees
aslant, and what stands beside the surface is often cleared by that.
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
    errors,
    null_space_gradient,
    singular_values,
)

_STEP_RAD, _STEP_SHARE = 0.25, 2.0
"""Between neighbouring waypoints joints may move by the first and that many times the angle by
which the tool's axis turns and, 0.3 m a radian, the place moves; more is a jump to another
configuration."""
_IMPROVEMENTS = 5
LEANS = (0.5, 1.0)
"""Shares of the tool's lean that are tried where the planned axis is blocked, the less first."""
_LEAN_WAYS = 8


def advance(
    cell: Cell,
    turn: np.ndarray,
    joints: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Joints (b, n) at the next targets, from those at the last ones and those before, and whether
    (b,) the arm gets there without a jump, a collision or a singularity."""
    chain = cell.chain
    at, along = cell.to_base(turn, positions, axes)
    frames = chain.frames(joints)
    wish = null_space_gradient(cell, frames, joints, cell.clearance(frames, turn))
    moved = np.clip(joints + np.clip(joints - before, -0.1, 0.1), chain.lower, chain.upper)
    good = np.zeros(len(joints), bool)
    for k in range(_IMPROVEMENTS):
        todo = np.flatnonzero(~good)
        frames = chain.frames(moved[todo])
        if k:
            away, angle = errors(frames, at[todo], along[todo])
            arrived = (away < POSITION_M) & (angle < AXIS_RAD)
            good[todo[arrived]] = True
            if k + 1 == _IMPROVEMENTS or arrived.all():
                break
            todo, frames = todo[~arrived], chain.frames(moved[todo[~arrived]])
        hope = wish[todo] if k == 0 else None
        moved[todo] = damped_least_squares_step(
            chain, frames, moved[todo], at[todo], along[todo], hope
        )
    start = chain.frames(joints)
    far, turned = errors(start, at, along)
    allowed = _STEP_RAD + _STEP_SHARE * (turned + far / 0.3)
    good &= np.abs(moved - joints).max(axis=1) < allowed
    frames = chain.frames(moved)
    good &= cell.clearance(frames, turn).least > LEAST_CLEARANCE_M
    good &= singular_values(frames) > LEAST_SINGULAR
    if good.any():
        left = np.flatnonzero(good)
        good[left] = cell.own_clearance(chain.frames(moved[left])) > LEAST_CLEARANCE_M
    return moved, good


def leaned(axes: np.ndarray, angle: float, ways: int = _LEAN_WAYS) -> np.ndarray:
    """Axes (b, ways, 3) that lean by an angle, rad, from axes (b, 3), to every side."""
    helper = np.eye(3)[np.abs(axes).argmin(axis=1)]
    one = np.cross(axes, helper)
    one /= np.linalg.norm(one, axis=1, keepdims=True)
    other = np.cross(axes, one)
    way = np.arange(ways) * 2.0 * np.pi / ways
    aside = np.cos(way)[:, None] * one[:, None] + np.sin(way)[:, None] * other[:, None]
    return np.asarray(np.cos(angle) * axes[:, None] + np.sin(angle) * aside)


def advance_leaning(
    cell: Cell,
    turn: np.ndarray,
    joints: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    axes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As `advance`, the tool leaning where it must; also the axes (b, 3) that it has then."""
    moved, good = advance(cell, turn, joints, before, positions, axes)
    held = axes.copy()
    for share in LEANS:
        failed = np.flatnonzero(~good)
        if not len(failed):
            break
        tried = leaned(axes[failed], share * cell.tool.leans_rad)
        many = failed.repeat(_LEAN_WAYS)
        there, fine = advance(
            cell, turn[many], joints[many], before[many], positions[many], tried.reshape(-1, 3)
        )
        fine = fine.reshape(len(failed), _LEAN_WAYS)
        # Of the sides that are clear the one in their middle: farthest from what is in the way.
        middle = np.einsum("bk,bka->ba", fine, tried)
        closeness = np.where(fine, np.einsum("bka,ba->bk", tried, middle), -np.inf)
        side, row = closeness.argmax(axis=1), np.arange(len(failed))
        there = there.reshape(len(failed), _LEAN_WAYS, -1)[row, side]
        found = fine.any(axis=1)
        done = failed[found]
        moved[done], held[done], good[done] = there[found], tried[row, side][found], True
    return moved, good, held


def advance_along(
    cell: Cell, turn: np.ndarray, joints: np.ndarray, ways: list[np.ndarray], axes: np.ndarray
) -> list[np.ndarray]:
    """Joints (k, n) along free moves from the surface, each as far as it is clear."""
    driven: list[list[np.ndarray]] = [[] for _ in ways]
    active = np.arange(len(ways))
    before = joints
    step = 0
    while True:
        more = np.array([len(ways[i]) > step for i in active], bool)
        active, joints, before = active[more], joints[more], before[more]
        if not len(active):
            return [np.array(d).reshape(len(d), cell.chain.size) for d in driven]
        place = np.array([ways[i][step] for i in active])
        moved, good = advance(cell, turn[active], joints, before, place, axes[active])
        for i, values, fine in zip(active, moved, good, strict=True):
            if fine:
                driven[i].append(values)
        active, before, joints = active[good], joints[good], moved[good]
        step += 1
