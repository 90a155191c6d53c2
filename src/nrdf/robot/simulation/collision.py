"""Collisions at every step of the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.toolpath.types import SegmentGroup

_BATCH = 4000


@dataclass(frozen=True)
class Collision:
    """Contact during one action. what: "object", "floor", "keep-out box" or "itself"; depth_m: how
    deep, at most, the spheres that enclose the arm's shapes are in it; kind, line: of the action.
    """

    region: str
    kind: str
    line: int
    what: str
    seconds: float
    depth_m: float


@dataclass(frozen=True)
class TimedCollision:
    """A collision, and at which of its action's steps (t,) it happens."""

    collision: Collision
    steps: np.ndarray


def find_collisions(
    cell: Cell, region: str, groups: Sequence[SegmentGroup], log: ExecutionLog
) -> list[TimedCollision]:
    """Collisions of the executed joints, at every step."""
    found = []
    action = log.action
    line = groups[action.group].process.line if action.group >= 0 else -1
    if len(action.angles_rad):
        cell, index = cell.at_turntable_angles(action.angles_rad), np.arange(len(log.joints))
    else:
        index = np.full(len(log.joints), action.turntable_index)
    for what, away in clearances(cell, log.joints, index).items():
        hit = away < 0.0
        if hit.any():
            seconds, depth = float(hit.sum() * STEP_S), -float(away.min())
            found.append(
                TimedCollision(Collision(region, action.kind, line, what, seconds, depth), hit)
            )
    return found


def clearances(cell: Cell, joints: np.ndarray, index: np.ndarray) -> dict[str, np.ndarray]:
    """Distances (t,), m, of joints (t, n) from object, floor, keep-out boxes and the arm itself.

    index: (t,) of the turntable.
    """
    names = ("object", "floor", "keep-out box", "itself")
    parts: dict[str, list[np.ndarray]] = {name: [] for name in names}
    for start in range(0, len(joints), _BATCH):
        frames = cell.chain.frames(joints[start : start + _BATCH])
        near = cell.clearance(frames, index[start : start + _BATCH])
        far = np.full(len(frames.tcp), np.inf)
        other = near.floor | near.keep_out
        parts["object"].append(np.where(other, far, near.least))
        parts["floor"].append(np.where(near.floor, near.least, far))
        parts["keep-out box"].append(np.where(near.keep_out, near.least, far))
        parts["itself"].append(cell.self_clearance(frames))
    return {name: np.concatenate(values) for name, values in parts.items()}
