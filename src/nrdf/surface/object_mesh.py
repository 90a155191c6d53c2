"""The mesh that paths are planned on: the object's own, or one made of its points."""

from __future__ import annotations

import numpy as np

from nrdf.errors import ProcessError
from nrdf.io.cloud import PointCloud
from nrdf.surface.scan_mesh import mesh_from_scan
from nrdf.surface.target_mesh import TargetMesh

_EDGES_PER_RADIUS = 5  # of the tool: finer than it can follow only costs time


def object_mesh(cloud: PointCloud, tool_radius_m: float) -> TargetMesh:
    """The surface of an object in metres, at its own resolution, faces outward.

    A cloud that was sampled from a mesh (`cloud.mesh`) has that mesh's outer skin. Any other one
    has the mesh through its points (`nrdf.surface.scan_mesh`), with edges of a fifth of the
    tool's radius, m, or of the distance between its points where that is more; holes stay open
    where it has no points. `repairs` of what is returned says what was changed.

    Raises ProcessError for a mesh that is no surface, a radius that is not above 0, and points
    that no surface can be made of: without normals, too few, or scattered.
    """
    if not (np.isfinite(tool_radius_m) and tool_radius_m > 0.0):
        raise ProcessError(f"the tool's radius must be above 0 m, not {tool_radius_m:g}")
    if cloud.mesh is not None:
        return TargetMesh.from_mesh(cloud.mesh)
    return _of_points(cloud, tool_radius_m / _EDGES_PER_RADIUS)


def _of_points(cloud: PointCloud, edge_m: float) -> TargetMesh:
    """The mesh through a cloud's points, with edges of about `edge_m`."""
    if cloud.normals is None:
        raise ProcessError(
            "a mesh cannot be made of points without normals; estimate them first "
            "(nrdf.geometry.normals.estimate_normals)"
        )
    return mesh_from_scan(cloud.points, cloud.normals, edge_m)
