"""Every step of the simulation is looked at: does anything touch that should not?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.robot.cell import Cell
from nrdf.robot.execute import Log
from nrdf.robot.lines import Line
from nrdf.robot.timing import STEP_S

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


def find_collisions(
    cell: Cell, region: str, lines: Sequence[Line], logs: Sequence[Log]
) -> list[Collision]:
    """Collisions of the joints that were really driven, at every step."""
    found = []
    for log in logs:
        for what, away in clearances(cell, log.joints, log.action.turn).items():
            hit = away < 0.0
            if hit.any():
                line = lines[log.action.line].number if log.action.line >= 0 else -1
                seconds = float(hit.sum() * STEP_S)
                depth = -float(away.min())
                found.append(Collision(region, log.action.kind, line, what, seconds, depth))
    return found


def clearances(cell: Cell, joints: np.ndarray, turn: int) -> dict[str, np.ndarray]:
    """Distances (t,), m, of joints (t, n) from the object, the floor, and the arm itself."""
    parts: dict[str, list[np.ndarray]] = {"object": [], "floor": [], "itself": []}
    for start in range(0, len(joints), _BATCH):
        frames = cell.chain.frames(joints[start : start + _BATCH])
        turns = np.full(len(frames.tcp), turn)
        near = cell.clearance(frames, turns)
        far = np.full(len(turns), np.inf)
        parts["object"].append(np.where(near.floor, far, near.least))
        parts["floor"].append(np.where(near.floor, near.least, far))
        parts["itself"].append(cell.own_clearance(frames))
    return {name: np.concatenate(values) for name, values in parts.items()}
