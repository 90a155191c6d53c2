"""The arm's next step towards a place, from where it is, without a jump."""

from __future__ import annotations

import numpy as np

from nrdf.robot.cell import Cell
from nrdf.robot.inverse import (
    AXIS_RAD,
    LEAST_CLEARANCE_M,
    LEAST_SINGULAR,
    POSITION_M,
    errors,
    improve,
    singular_values,
    wishes,
)

_STEP_RAD, _STEP_SHARE = 0.25, 2.0
"""Between neighbouring waypoints joints may move by the first and that many times the angle by
which the tool's axis turns and, 0.3 m a radian, the place moves; more is a jump to another
configuration."""
_IMPROVEMENTS = 5


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
    wish = wishes(cell, frames, joints, cell.clearance(frames, turn))
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
        moved[todo] = improve(chain, frames, moved[todo], at[todo], along[todo], hope)
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
