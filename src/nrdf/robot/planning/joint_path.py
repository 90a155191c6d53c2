"""Joint paths: process segments, or parts of them, as the arm drives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from nrdf.geometry.polylines import interpolate, step_lengths
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.inverse_kinematics import LEAST_CLEARANCE_M, solve
from nrdf.toolpath.types import SegmentGroup

_STEP_M, _STEP_RAD = 0.004, np.radians(3.0)  # between interpolated positions
_LEAST_CLEARANCE_M = 0.5 * LEAST_CLEARANCE_M
"""Clearance between waypoints, where the object may bulge."""


def _none() -> np.ndarray:
    return np.zeros((0, 0))


@dataclass(frozen=True)
class JointPath:
    """A process segment, or a part of it, solved for the arm at one turntable index.

    group: index of its segment group; first, last: of the segment's waypoints, inclusive. axes:
    (m, 3) of the tool there, in the object's frame: the planned ones unless tilted; joints: (m, n).

    dense: (k, n) joints along the path, with positions between the waypoints; waypoint: (k,) where
    each is, a number between 0 and m - 1. approach (j, n), retract (j, n): joints along the free
    moves to and from the surface. Empty until `densify` and `add_approach_retract` fill them.
    """

    group: int
    first: int
    last: int
    turntable_index: int
    axes: np.ndarray
    joints: np.ndarray
    dense: np.ndarray = field(default_factory=_none)
    waypoint: np.ndarray = field(default_factory=lambda: np.zeros(0))
    approach: np.ndarray = field(default_factory=_none)
    retract: np.ndarray = field(default_factory=_none)

    def whole(self) -> np.ndarray:
        """Joints (k, n) from the approach's start to the retract's end."""
        return np.concatenate([self.approach, self.dense, self.retract])

    def shifted(self, shift: np.ndarray) -> JointPath:
        """The same with its joints shifted by (n,)."""
        return replace(
            self,
            joints=self.joints + shift,
            dense=self.dense + shift,
            approach=self.approach + shift,
            retract=self.retract + shift,
        )


def densify(
    cell: Cell, groups: Sequence[SegmentGroup], paths: Sequence[JointPath]
) -> list[tuple[JointPath, np.ndarray]]:
    """Joint paths with positions between their waypoints that are on the segment too, and after
    which waypoints (m - 1,) of each something is in the way.

    Between waypoints, joints that move evenly would take the tool off the straight line.
    """
    numbers, guesses, targets, axes = [], [], [], []
    for path in paths:
        positions = groups[path.group].process.positions[path.first : path.last + 1]
        number = _numbers(positions, path.axes)
        along = _interpolated(number, path.axes)
        numbers.append(number)
        guesses.append(_interpolated(number, path.joints))
        targets.append(_interpolated(number, positions))
        axes.append(along / np.linalg.norm(along, axis=1, keepdims=True))
    sizes = [len(number) for number in numbers]
    index = np.repeat([path.turntable_index for path in paths], sizes)
    at, along = cell.to_base(index, np.concatenate(targets), np.concatenate(axes))
    joints, good = solve(cell.chain, np.concatenate(guesses), at, along, 8)
    frames = cell.chain.frames(joints)
    good &= cell.clearance(frames, index).least > _LEAST_CLEARANCE_M
    good &= cell.self_clearance(frames) > _LEAST_CLEARANCE_M
    cuts = np.cumsum(sizes)[:-1]
    made = []
    for path, number, dense, clear in zip(
        paths, numbers, np.split(joints, cuts), np.split(good, cuts), strict=True
    ):
        blocked = np.zeros(max(path.last - path.first, 0), bool)
        # At a waypoint itself, joints are known to be good.
        wrong = ~clear & (number % 1.0 > 0.0)
        blocked[np.floor(number[wrong]).astype(int)] = True
        own = number % 1.0 == 0.0
        dense[own] = path.joints
        made.append((replace(path, dense=dense, waypoint=number), blocked))
    return made


def _numbers(positions: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """Numbers (k,) between 0 and m - 1 of waypoints (m, 3), and of positions between them."""
    if len(positions) == 1:
        return np.zeros(1)
    moved, turned = step_lengths(positions), step_lengths(axes)
    counts = np.ceil(np.maximum(moved / _STEP_M, turned / _STEP_RAD)).astype(int).clip(1, 80)
    steps = [k + np.arange(count) / count for k, count in enumerate(counts)]
    return np.append(np.concatenate(steps), len(positions) - 1.0)


def _interpolated(number: np.ndarray, values: np.ndarray) -> np.ndarray:
    return interpolate(number, np.arange(len(values)), values)
