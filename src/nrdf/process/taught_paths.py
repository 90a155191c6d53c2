"""Taught waypoints as segments on the reference's mesh, and what they are over."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import readable
from nrdf.process.process import Process, TaughtSegment
from nrdf.regions.region import ON_REFERENCE
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.frames import tool_quaternions, travel_directions
from nrdf.toolpath.types import Segment


def taught_segments(process: Process, mesh: TargetMesh) -> tuple[Segment, ...]:
    """A process segment for each line of a taught process.

    Where a line gives no orientations, the tool follows the reference's surface. Raises
    ProcessError, naming line and waypoint, for one that is farther from the surface than its
    stand-off and 2 % of the object's longest side.
    """
    allowed = process.standoff_m + ON_REFERENCE * mesh.size
    segments = []
    for number, line in enumerate(process.waypoints or ()):
        positions = np.array(line.positions_m, float)
        away = mesh.nearest(positions).distances
        if (away > allowed).any():
            worst = int(away.argmax())
            raise ProcessError(
                f"waypoints: number {worst + 1} of line {number + 1} is "
                f"{readable('away_m', float(away[worst]))} from the reference; at most "
                f"{readable('allowed_m', allowed)} is allowed with standoff_m "
                f"{process.standoff_m:g}. Is it in the reference's frame, in metres?"
            )
        quaternions = _quaternions(line, positions, process, mesh)
        segments.append(
            Segment(
                "process", number, positions, quaternions,
                process.feed_m_s, process.force_n, process.dwell_s,
            )
        )  # fmt: skip
    return tuple(segments)


def check_origin(process: Process, mesh: TargetMesh) -> None:
    """Raise ProcessError for a taught origin that is not on the reference."""
    if process.origin_m is None or process.origin_mode == "fixed":
        return
    away = float(mesh.nearest(np.array([process.origin_m])).distances[0])
    allowed = ON_REFERENCE * mesh.size
    if away > allowed:
        raise ProcessError(
            f"origin_m is {readable('away_m', away)} from the reference; at most "
            f"{readable('allowed_m', allowed)} is allowed for a taught origin. Is it in the "
            "reference's frame, in metres? With origin_mode: fixed it may lie anywhere"
        )


def _quaternions(
    line: TaughtSegment, positions: np.ndarray, process: Process, mesh: TargetMesh
) -> np.ndarray:
    """The orientations (n, 4) of a taught line, given or from the surface."""
    if line.quaternions_xyzw is not None:
        return np.array(line.quaternions_xyzw, float)
    near = mesh.nearest(positions)
    normals = mesh.smooth_normals(near.points, near.faces, process.tool.radius_m)
    if len(positions) > 1:
        travel = travel_directions(positions, 0.5 * process.distance_between_lines_m)
    else:
        travel = np.array([process.direction or (1.0, 0.0, 0.0)])
    return tool_quaternions(travel, normals, process.lead_rad, process.tilt_rad)


def normals_under(
    mesh: TargetMesh, segments: Sequence[Segment], tool_radius_m: float
) -> list[np.ndarray]:
    """Outward normals (n, 3) of the surface under a flat tool at each segment's waypoints."""
    found = []
    for segment in segments:
        near = mesh.nearest(segment.positions, -segment.axes)
        found.append(mesh.smooth_normals(near.points, near.faces, tool_radius_m))
    return found
