"""The mesh that paths are planned on: the object's own, or one made of its points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.io.cloud import PointCloud
from nrdf.surface.poisson_mesh import poisson_mesh
from nrdf.surface.scan_mesh import mesh_from_scan
from nrdf.surface.target_mesh import TargetMesh

_EDGES_PER_RADIUS = 5  # of the tool: finer than it can follow only costs time
_ASKED, _NEIGHBOURS = 4000, 8  # points that a mesh is judged by; those that tell their spacing
_SPARSE = 2.5  # edges that points of a sparse cloud are apart, at least
_CRACKED = 20.0  # spacings of border from which a mesh of sparse points is full of cracks
_OFF, _WORSE = 0.6, 0.02  # spacings from which a point has no surface; share of them that decides


def object_mesh(cloud: PointCloud, tool_radius_m: float) -> TargetMesh:
    """The surface of an object in metres, at its own resolution, faces outward.

    A cloud that was sampled from a mesh (`cloud.mesh`) has that mesh's outer skin. Any other one
    has the mesh through its points (`nrdf.surface.scan_mesh`), with edges of a fifth of the
    tool's radius, m; holes stay open where it has no points. Points that are farther apart than
    that have the closed surface around them (`nrdf.surface.poisson_mesh`), unless its thin parts
    vanish or the object is open. `repairs` of what is returned says what was changed.

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
    points, normals = cloud.points, cloud.normals
    mesh = mesh_from_scan(points, normals, edge_m)
    some = np.linspace(0, len(points) - 1, min(_ASKED, len(points))).astype(int)
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    away = tree.query(points[some], [_NEIGHBOURS + 1])[0]
    spacing = float(np.median(away)) * np.sqrt(np.pi / _NEIGHBOURS)
    if spacing <= _SPARSE * edge_m or mesh.border_length <= _CRACKED * spacing:
        return mesh
    try:
        closed = poisson_mesh(points, normals)
    except ProcessError:
        return mesh
    missed = [
        float((made.nearest(points[some], normals[some]).distances > _OFF * spacing).mean())
        for made in (closed, mesh)
    ]
    good = closed.border_length <= mesh.border_length and missed[0] <= missed[1] + _WORSE
    return closed if good else mesh
