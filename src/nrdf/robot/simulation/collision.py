"""Every step of the simulation is looked at: does anything touch that should not?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.lines import Line
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.execute import Log

_BATCH = 4000


@dataclass(frozen=True)
class Collision:
    """One stretch of touching. what: "object", "floor" or "itself"; depth_m: how deep, at most, the
    spheres that enclose the arm's shapes are in it; kind, line: of the move."""

    region: str
    kind: str
    line: int
    what: str
    seconds: float
    depth_m: float


@dataclass(frozen=True)
class TimedCollision:
    """A collision, and at which of its action's steps (t,) it is."""

    collision: Collision
    steps: np.ndarray


def find_collisions(
    cell: Cell, region: str, lines: Sequence[Line], log: Log
) -> list[TimedCollision]:
    """Collisions of the joints that were really driven, at every step."""
    found = []
    action = log.action
    line = lines[action.line].number if action.line >= 0 else -1
    if len(action.angles_rad):
        cell, turn = cell.turned(action.angles_rad), np.arange(len(log.joints))
    else:
        turn = np.full(len(log.joints), action.turn)
    for what, away in clearances(cell, log.joints, turn).items():
        hit = away < 0.0
        if hit.any():
            seconds, depth = float(hit.sum() * STEP_S), -float(away.min())
            found.append(
                TimedCollision(Collision(region, action.kind, line, what, seconds, depth), hit)
            )
    return found


def clearances(cell: Cell, joints: np.ndarray, turn: np.ndarray) -> dict[str, np.ndarray]:
    """Distances (t,), m, of joints (t, n) at turns (t,) from the object, the floor, and the arm
    itself."""
    parts: dict[str, list[np.ndarray]] = {"object": [], "floor": [], "itself": []}
    for start in range(0, len(joints), _BATCH):
        frames = cell.chain.frames(joints[start : start + _BATCH])
        near = cell.clearance(frames, turn[start : start + _BATCH])
        far = np.full(len(frames.tcp), np.inf)
        parts["object"].append(np.where(near.floor, far, near.least))
        parts["floor"].append(np.where(near.floor, near.least, far))
        parts["itself"].append(cell.own_clearance(frames))
    return {name: np.concatenate(values) for name, values in parts.items()}
