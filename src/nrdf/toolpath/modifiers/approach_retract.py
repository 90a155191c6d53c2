"""Approach and retract: the free moves to a line and away from it, straight and along arcs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.toolpath.frames import surface_frames
from nrdf.toolpath.types import Segment

_STEPS = 6  # of an arc, at least


@dataclass(frozen=True)
class FreeMove:
    """Straight by distance_m, angle_rad from the normal (0: along it; pi/2: along the line), at
    feed_m_s; next to the line an arc of radius_m, 0 for none, turns the way into the line's."""

    distance_m: float
    angle_rad: float
    feed_m_s: float
    radius_m: float = 0.0

    def way(
        self, place: np.ndarray, normal: np.ndarray, away: np.ndarray, spacing_m: float
    ) -> np.ndarray:
        """Positions (k, 3), m, from a line's end on: at a place (3,), normal and, square to it, the
        direction (3,) that leads away from the line; that place alone for no move."""
        ways = [place[None]]
        turn = 0.5 * np.pi - self.angle_rad
        if self.radius_m > 0.0 and turn > 1e-6:
            count = max(int(np.ceil(turn * self.radius_m / spacing_m)), _STEPS)
            angle = turn * (np.arange(count) + 1.0)[:, None] / count
            ways.append(
                place + self.radius_m * (np.sin(angle) * away + (1.0 - np.cos(angle)) * normal)
            )
        if self.distance_m > 0.0:
            straight = np.sin(self.angle_rad) * away + np.cos(self.angle_rad) * normal
            ways.append((ways[-1][-1] + self.distance_m * straight)[None])
        return np.concatenate(ways)


def approach_retract(
    lines: Sequence[Segment],
    normals: Sequence[np.ndarray],
    approach: FreeMove,
    retract: FreeMove,
    spacing_m: float,
) -> list[Segment]:
    """Process segments, each with the approach before it and the retract after it.

    normals: (n, 3), outward, of the surface under each line's waypoints. A free move of no length
    is left out. The tool keeps the orientation of the line's end.
    """
    segments: list[Segment] = []
    for line, outward in zip(lines, normals, strict=True):
        ahead = _travel(line, outward)
        start = approach.way(line.positions[0], outward[0], -ahead[0], spacing_m)
        stop = retract.way(line.positions[-1], outward[-1], ahead[1], spacing_m)
        if len(start) > 1:
            held = np.repeat(line.quaternions_xyzw[:1], len(start), axis=0)
            segments.append(Segment("approach", line.line, start[::-1], held, approach.feed_m_s))
        segments.append(line)
        if len(stop) > 1:
            held = np.repeat(line.quaternions_xyzw[-1:], len(stop), axis=0)
            segments.append(Segment("retract", line.line, stop, held, retract.feed_m_s))
    return segments


def _travel(line: Segment, normals: np.ndarray) -> np.ndarray:
    """Unit directions of travel (2, 3) at a line's ends, square to the normals (n, 3) there: of its
    first and last step, or tool x where it has none."""
    positions = line.positions
    if len(positions) > 1:
        travel = np.stack([positions[1] - positions[0], positions[-1] - positions[-2]])
    else:
        travel = Rotation.from_quat(line.quaternions_xyzw[[0, 0]]).as_matrix()[:, :, 0]
    return surface_frames(travel, normals[[0, -1]])[:, :, 0]
