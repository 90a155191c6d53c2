"""EncodedReference waypoints carried to another object.

Each waypoint's foot on the reference's surface goes through the correspondence, and the tool keeps
its place and angles relative to the local frame of travel and normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.process.correspondence import Correspondence, lengths
from nrdf.process.taught_paths import TaughtLine, feet_under
from nrdf.toolpath.frames import surface_frames, travel_of

_TORN, _GAP = 1.5, 1.2  # times its length on the reference, and spacings, that a step may have
_SMOOTH = 2.0  # spacings of points over which the direction of travel is averaged


@dataclass(frozen=True)
class CarriedLine(TaughtLine):
    """A line on the target. normals: (n, 3) of the surface under it; taught: number of the taught
    line; waypoints: (n,) which of its waypoints these are."""

    normals: np.ndarray
    taught: int
    waypoints: np.ndarray


def carry(
    way: Correspondence, lines: Sequence[TaughtLine], tool_radius_m: float
) -> tuple[tuple[CarriedLine, ...], int]:
    """Lines on the reference as lines on the target, and how many waypoints have no place.

    A line is cut where waypoints have no counterpart, and where the surface is torn between
    two of them, so that no tool is driven across a gap. The tool's height over the surface, and
    its angles to travel and normal, stay; a flat tool of `tool_radius_m` feels the normals.
    """
    if not lines:
        return (), 0
    source = way.reference.surface
    positions = np.concatenate([line.positions for line in lines])
    quaternions = np.concatenate([line.quaternions_xyzw for line in lines])
    owner = np.repeat(np.arange(len(lines)), [len(line.positions) for line in lines])
    turns = Rotation.from_quat(quaternions).as_matrix()
    feet, normals = feet_under(source, positions, -turns[:, :, 2])
    felt = source.smooth_normals(feet, normals, tool_radius_m)
    found, found_normals, exists = way.places(feet, normals)
    found_felt = way.target.smooth_normals(found, found_normals, tool_radius_m)
    # Where there is no line to tell the travel, a short way along tool x is mapped.
    ahead, ahead_normals = source.project(feet + 2 * source.spacing * turns[:, :, 0], normals)
    step = way.places(ahead, ahead_normals)[0] - found
    grown = way.embedded.pose.scale / way.reference.taught.reference.pose.scale
    carried, lost = [], int((~exists).sum())
    for number in range(len(lines)):
        mine = np.flatnonzero(owner == number)
        step_there = lengths(np.diff(found[mine], axis=0))
        step_here = lengths(np.diff(feet[mine], axis=0))
        torn = step_there > _TORN * grown * step_here + _GAP * way.target.spacing
        for run in _runs(exists[mine], torn):
            at = mine[run]
            frames = _frames(feet[at], felt[at], turns[at, :, 0], source.spacing)
            there = _frames(found[at], found_felt[at], step[at], way.target.spacing)
            change = there @ frames.transpose(0, 2, 1)
            offset = np.einsum("mab,mb->ma", change, positions[at] - feet[at])
            turned = Rotation.from_matrix(change @ turns[at]).as_quat()
            line = CarriedLine(found[at] + offset, turned, found_felt[at], number, run)
            carried.append(line)
    return tuple(carried), lost


def _frames(
    points: np.ndarray, normals: np.ndarray, alone: np.ndarray, spacing: float
) -> np.ndarray:
    """Frames (n, 3, 3) of travel and normal along a line; `alone` (n, 3) is the travel of one
    that stands still."""
    moves = len(points) > 1 and float(np.ptp(points, axis=0).max()) > 0.5 * spacing
    travel = travel_of(points, _SMOOTH * spacing) if moves else alone
    return surface_frames(travel, normals)


def _runs(good: np.ndarray, torn: np.ndarray) -> list[np.ndarray]:
    """Indices of each stretch of True in `good` (n,) that `torn` (n - 1,) between two does not
    break."""
    places = np.flatnonzero(good)
    if not len(places):
        return []
    broken = (np.diff(places) > 1) | torn[places[:-1]]
    return np.split(places, np.flatnonzero(broken) + 1)
