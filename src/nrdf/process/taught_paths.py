"""Taught waypoints on the reference, and the surface under a tool."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.frames import z_axes
from nrdf.geometry.units import readable
from nrdf.process.process import Process, TaughtSegment
from nrdf.regions.region import ON_REFERENCE
from nrdf.surface.surface import Surface
from nrdf.toolpath.frames import tool_quaternions, travel_directions
from nrdf.toolpath.types import Segment

_SMOOTH = 2.0  # spacings of points over which the direction of travel is averaged
_FACING = 0.1  # cosine above which a side faces a tool: the side round a square corner does not


def taught_segments(process: Process, surface: Surface) -> tuple[Segment, ...]:
    """A process segment for each line of a taught process.

    Where a line gives no orientations, the tool follows the reference's surface. Raises
    ProcessError, naming line and waypoint, for one that is farther from the surface than its
    stand-off and 2 % of the object's longest side.
    """
    allowed = process.standoff_m + ON_REFERENCE * float(np.ptp(surface.points, axis=0).max())
    segments = []
    for number, line in enumerate(process.waypoints or ()):
        positions = np.array(line.positions_m, float)
        # What lies between points is on the surface.
        away = np.maximum(surface.tree.query(positions)[0] - surface.spacing, 0.0)
        if (away > allowed).any():
            worst = int(away.argmax())
            raise ProcessError(
                f"waypoints: number {worst + 1} of line {number + 1} is "
                f"{readable('away_m', float(away[worst]))} from the reference; at most "
                f"{readable('allowed_m', allowed)} is allowed with standoff_m "
                f"{process.standoff_m:g}. Is it in the reference's frame, in metres?"
            )
        quaternions = _quaternions(line, positions, process, surface)
        segments.append(
            Segment(
                "process", number, positions, quaternions,
                process.feed_m_s, process.force_n, process.dwell_s,
            )
        )  # fmt: skip
    return tuple(segments)


def _quaternions(
    line: TaughtSegment, positions: np.ndarray, process: Process, surface: Surface
) -> np.ndarray:
    """The orientations (n, 4) of a taught line, given or from the surface."""
    if line.quaternions_xyzw is not None:
        return np.array(line.quaternions_xyzw, float)
    nearest = surface.tree.query(positions)[1]
    normals = surface.project(surface.points[nearest], surface.normals[nearest])[1]
    if len(positions) > 1:
        travel = travel_directions(positions, _SMOOTH * surface.spacing)
    else:
        travel = np.array([process.direction or (1.0, 0.0, 0.0)])
    return tool_quaternions(travel, normals, process.lead_rad, process.tilt_rad)


def surface_under(
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


def normals_under(surface: Surface, segments: Sequence[Segment]) -> list[np.ndarray]:
    """Outward normals (n, 3) of the surface under the tool at each segment's waypoints."""
    found = []
    for segment in segments:
        found.append(surface_under(surface, segment.positions, -segment.axes)[1])
    return found


def contact_points(
    positions: np.ndarray, quaternions_xyzw: np.ndarray, standoff_m: float
) -> np.ndarray:
    """Where tools at positions (n, 3) touch or point at the surface, (n, 3): a stand-off ahead of
    the tool centre point, along tool z."""
    along = z_axes(quaternions_xyzw)
    return np.asarray(positions + standoff_m * along)
