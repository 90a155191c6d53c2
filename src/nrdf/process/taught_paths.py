"""EncodedReference lines of waypoints on the reference, and what of its surface lies under them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.units import in_words
from nrdf.process.knowledge import Process, TaughtSegment
from nrdf.regions.region import ON_REFERENCE
from nrdf.surface.surface import Surface
from nrdf.toolpath.frames import tool_quaternions, travel_of

_SMOOTH = 2.0  # spacings of points over which the direction of travel is averaged
_FACING = 0.1  # cosine above which a side faces a tool: the side round a square corner does not


@dataclass(frozen=True)
class TaughtLine:
    """A line of waypoints: positions (n, 3), m, and quaternions_xyzw (n, 4), tool to object."""

    positions: np.ndarray
    quaternions_xyzw: np.ndarray


def taught_lines(process: Process, surface: Surface) -> tuple[TaughtLine, ...]:
    """The lines of a taught process; tools without orientation follow the reference's surface.

    Raises ProcessError, naming line and waypoint, for one that is farther from the surface than
    its stand-off and 2 % of the object's longest side.
    """
    allowed = process.standoff_m + ON_REFERENCE * float(np.ptp(surface.points, axis=0).max())
    lines = []
    for number, line in enumerate(process.waypoints or (), 1):
        positions = np.array(line.positions_m, float)
        # What lies between points is on the surface.
        away = np.maximum(surface.tree.query(positions)[0] - surface.spacing, 0.0)
        if (away > allowed).any():
            worst = int(away.argmax())
            raise ProcessError(
                f"waypoints: number {worst + 1} of line {number} is "
                f"{in_words('away_m', float(away[worst]))} from the reference; at most "
                f"{in_words('allowed_m', allowed)} is allowed with standoff_m "
                f"{process.standoff_m:g}. Is it in the reference's frame, in metres?"
            )
        lines.append(TaughtLine(positions, _turns(line, positions, process, surface)))
    return tuple(lines)


def _turns(
    line: TaughtSegment, positions: np.ndarray, process: Process, surface: Surface
) -> np.ndarray:
    if line.quaternions_xyzw is not None:
        return np.array(line.quaternions_xyzw, float)
    nearest = surface.tree.query(positions)[1]
    normals = surface.project(surface.points[nearest], surface.normals[nearest])[1]
    if len(positions) > 1:
        travel = travel_of(positions, _SMOOTH * surface.spacing)
    else:
        travel = np.array([process.direction or (1.0, 0.0, 0.0)])
    return tool_quaternions(travel, normals, process.lead_rad, process.tilt_rad)


def feet_under(
    surface: Surface, positions: np.ndarray, axes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The smooth surface under tools at positions (m, 3), and its normals there, each (m, 3).

    axes: (m, 3), from the tool's tip to its tail; the nearest surface that faces the tail counts,
    so that a tool near a thin part's edge stays on its side.
    """
    near = surface.tree.query(positions, np.arange(1, min(32, len(surface.points)) + 1))[1]
    facing = np.einsum("mka,ma->mk", surface.normals[near], axes) > _FACING
    # The first that faces the tool, or the nearest of all.
    first = near[np.arange(len(near)), facing.argmax(axis=1)]
    start, normals = surface.points[first], surface.normals[first]
    height = np.einsum("ma,ma->m", positions - start, normals)
    sideways = positions - start - height[:, None] * normals
    length = np.linalg.norm(sideways, axis=1, keepdims=True)
    sideways *= np.minimum(1.0, 2 * surface.spacing / np.maximum(length, 1e-12))
    return surface.project(start + sideways, normals)


def normals_under(surface: Surface, lines: Sequence[TaughtLine]) -> list[np.ndarray]:
    """Outward normals (n, 3) of the surface under each line's tools."""
    found = []
    for line in lines:
        axes = -Rotation.from_quat(line.quaternions_xyzw).as_matrix()[:, :, 2]
        found.append(feet_under(surface, line.positions, axes)[1])
    return found
