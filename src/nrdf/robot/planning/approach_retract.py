"""Free moves between the surface and the air: the approach to a joint path, and the retract."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.polylines import resample, total_length
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.joint_path import JointPath
from nrdf.robot.planning.path_tracking import advance_free, tilted_axes
from nrdf.toolpath.types import Segment, SegmentGroup

_STEP_M = 0.012
_SHORT_M = 0.03  # of a move that the tool path does not have, or inside a line
_LEAST_STEPS = 2  # that the tool must be able to take from the surface
_ASLANT_RAD, _ASLANT_DIRECTIONS = np.radians(45.0), 6
_LENGTHENED_STEPS = 16


def approach_positions(group: SegmentGroup) -> np.ndarray:
    """Positions (k, 3) from the approach's start to before the first waypoint."""
    return _free_move(group.approach, group.process.positions[0], group.process.axes[0])


def retract_positions(group: SegmentGroup) -> np.ndarray:
    """Positions (k, 3) from after the last waypoint to the retract's end."""
    segment, process = group.retract, group.process
    return _free_move(segment, process.positions[-1], process.axes[-1], backwards=True)[::-1]


def _free_move(
    segment: Segment | None, end: np.ndarray, axis: np.ndarray, backwards: bool = False
) -> np.ndarray:
    """Even positions of a free move that ends on the surface at `end`, without the end itself;
    straight along the axis where there is no segment."""
    if segment is None:
        corners = np.stack([end - _SHORT_M * axis, end])
    else:
        corners = segment.positions[::-1] if backwards else segment.positions
    if total_length(corners) < 1e-6:
        return np.zeros((0, 3))
    return resample(corners, _STEP_M)[:-1]


def add_approach_retract(
    cell: Cell, groups: Sequence[SegmentGroup], paths: Sequence[JointPath]
) -> list[JointPath | None]:
    """Joint paths with approach and retract; None where the tool cannot leave the surface.

    The tool leaves as the tool path says, or else straight along its axis, or else aslant.
    """
    ends = [(i, begins) for i in range(len(paths)) for begins in (True, False)]
    found: dict[tuple[int, bool], np.ndarray] = {}
    for attempt in range(2 + _ASLANT_DIRECTIONS):
        open_ends = [end for end in ends if end not in found]
        if not open_ends:
            break
        indices, joints, moves, axes = [], [], [], []
        for i, begins in open_ends:
            path = paths[i]
            row = 0 if begins else -1
            indices.append(path.turntable_index)
            joints.append(path.joints[row])
            axes.append(path.axes[row])
            moves.append(_move_away(groups[path.group], path, begins, attempt))
        solved = advance_free(cell, np.array(indices), np.array(joints), moves, np.array(axes))
        for end, some, wanted in zip(open_ends, solved, moves, strict=True):
            if len(some) >= min(len(wanted), _LEAST_STEPS):
                found[end] = some
    return [
        replace(path, approach=found[i, True][::-1], retract=found[i, False])
        if (i, True) in found and (i, False) in found
        else None
        for i, path in enumerate(paths)
    ]


def _move_away(group: SegmentGroup, path: JointPath, begins: bool, attempt: int) -> np.ndarray:
    """Positions (k, 3) by which the tool leaves a path's first or last waypoint, outwards, as tried
    in turn."""
    process = group.process
    waypoint = path.first if begins else path.last
    if attempt == 0:
        if begins and waypoint == 0:
            return approach_positions(group)[::-1]
        if not begins and waypoint == len(process.positions) - 1:
            return retract_positions(group)
        away = -process.axes[waypoint]
    else:
        axis = path.axes[0 if begins else -1]
        away = -axis
        if attempt > 1:
            tilted = tilted_axes(axis[None], np.pi - _ASLANT_RAD, _ASLANT_DIRECTIONS)
            away = tilted[0, attempt - 2]
    distances = np.arange(_SHORT_M, 0.5 * _STEP_M, -_STEP_M)[::-1]
    return np.asarray(process.positions[waypoint] + distances[:, None] * away)


def lengthen(cell: Cell, path: JointPath, start: bool) -> JointPath:
    """A joint path whose approach begins, or whose retract ends, farther from the surface: as far
    as is clear."""
    row = 0 if start else -1
    joints, axis = path.whole()[row], path.axes[row]
    pose = cell.T_base_object[path.turntable_index]
    tip = cell.chain.frames(joints[None]).tcp[0]
    tip = (tip - pose[:3, 3]) @ pose[:3, :3]
    move = tip - _STEP_M * np.arange(1, _LENGTHENED_STEPS + 1)[:, None] * axis
    index = np.array([path.turntable_index])
    solved = advance_free(cell, index, joints[None], [move], axis[None])[0]
    if start:
        return replace(path, approach=np.concatenate([solved[::-1], path.approach]))
    return replace(path, retract=np.concatenate([path.retract, solved]))
