"""A scan as a mesh to plan on: noise smoothed away, holes open, the sides of thin sheets apart."""

from __future__ import annotations

import igl
import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import triangle_crosses
from nrdf.surface.mesh_edges import edge_components
from nrdf.surface.scan_ends import closed, even_ends, trimmed
from nrdf.surface.scan_grid import zero_surface
from nrdf.surface.scan_points import ScanPoints, for_parts, smooth_points
from nrdf.surface.target_mesh import TargetMesh

_LEAST_POINTS = 50
_NEAREST = 8  # points that the surface at a vertex comes from
_OWN = 0.2  # cosine between the normals of a vertex and of points of its side
_LEAST_FACES = 24  # of a piece: smaller ones are noise
_NO_AREA = 1e-9  # of a face, in squares of a cell


def mesh_from_scan(points: np.ndarray, normals: np.ndarray, edge_m: float) -> TargetMesh:
    """The surface through the points of a scan, in triangles with edges of about `edge_m`.

    points: (n, 3), m; normals: (n, 3), towards where they were seen from. Each point is moved onto
    a quadric through those around it; the surface is where the signed distance to their tangent
    planes is 0 (implicit moving least squares, Kolluri 2005), found by marching cubes in the cells
    that it goes through. A sheet thinner than a cell is thickened meanwhile. Gaps between points
    are closed, larger holes and ends stay open. Edges are not made finer than three quarters of
    the distance between points, and very many points are thinned.

    Raises ProcessError for arrays that do not fit each other, too few points, points that no
    surface goes through, or normals that do not belong to them.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    normals = np.asarray(normals, dtype=np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or normals.shape != points.shape:
        raise ProcessError(f"points {points.shape} and normals {normals.shape} must be (n, 3)")
    if len(points) < _LEAST_POINTS:
        raise ProcessError(
            f"a surface needs at least {_LEAST_POINTS} points, not {len(points)}; give all points "
            "of the scan"
        )
    if not (np.isfinite(points).all() and np.isfinite(normals).all()):
        raise ProcessError("the points of a scan and their normals must be finite")
    if not (np.isfinite(edge_m) and edge_m > 0.0):
        raise ProcessError(f"the edge of a mesh must be above 0 m, not {edge_m:g}")
    scan = smooth_points(points, unit_vectors(normals), edge_m)
    tree = cKDTree(scan.points, balanced_tree=False, compact_nodes=False)
    vertices, faces = zero_surface(scan, tree)
    if len(faces):
        vertices, faces = _settled(scan, tree, vertices, faces)
    if not len(faces):
        raise ProcessError(
            "no surface goes through the points of the scan: they are too scattered, or their "
            "normals look into each other; leave the normals out, so that they are estimated"
        )
    number = edge_components(faces)
    count = np.bincount(number)
    large = count >= min(_LEAST_FACES, count.max())
    return TargetMesh(vertices, faces).submesh(large[number])


def _settled(
    scan: ScanPoints, tree: cKDTree, vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The mesh with its vertices on the surface itself, and its ends where the points end."""
    kind = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_AREA
    outward = unit_vectors(np.nan_to_num(igl.per_vertex_normals(vertices, faces, kind)))
    vertices, nearest, away = on_surface(scan, tree, vertices, outward)
    wide = np.maximum(scan.spacing, 0.8 * scan.cell)[nearest]
    good, area = _looking_out(scan, nearest, vertices, faces)
    faces = trimmed(faces, good, away / wide, area / wide[faces[:, 0]] ** 2)
    spacing = np.maximum(scan.spacing, 0.6 * scan.cell)[nearest]
    points, normals = scan.points[nearest], scan.normals[nearest]
    vertices = even_ends(vertices, faces, points, normals, spacing)
    faces = faces[_looking_out(scan, nearest, vertices, faces)[0]]
    return closed(vertices, faces, wide)


def _looking_out(
    scan: ScanPoints, nearest: np.ndarray, vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Whether faces (f,) look as one of the points that are `nearest` (v,) to their vertices does,
    and their areas (f,)."""
    cross = triangle_crosses(vertices, faces)
    area = np.linalg.norm(cross, axis=1) / 2.0
    facing = [np.einsum("fa,fa->f", cross, scan.normals[nearest[corner]]) for corner in faces.T]
    return (np.max(facing, axis=0) > 0.0) & (area > _NO_AREA * scan.cell**2), area


def on_surface(
    scan: ScanPoints, tree: cKDTree, vertices: np.ndarray, outward: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (v, 3) moved onto the surface of their side, to which normals `outward` (v, 3)
    point; the nearest point (v,) of that side; its distance (v,), m."""
    count = min(_NEAREST, len(scan.points))
    least = np.maximum(scan.spacing, 0.75 * scan.cell)
    moved, nearest = vertices.copy(), np.empty(len(vertices), np.int64)
    distances = np.empty(len(vertices))

    def work(part: slice) -> None:
        away, near = tree.query(vertices[part], count)
        normals = scan.normals[near]
        facing = np.maximum((normals @ outward[part][:, :, None])[..., 0], 0.0)
        own = facing > _OWN
        first, row = own.argmax(axis=1), np.arange(len(near))
        closest, distance = near[row, first], away[row, first]
        width = (least[closest] + 0.5 * distance)[:, None]
        weight = np.exp(-((away / width) ** 2)) * facing + 1e-30 * (near == closest[:, None])
        height = ((vertices[part][:, None] - scan.points[near]) * normals).sum(axis=2)
        rise = (weight * height).sum(axis=1) / weight.sum(axis=1)
        direction = unit_vectors((weight[:, None] @ normals)[:, 0])
        moved[part] -= np.clip(rise, -scan.cell, scan.cell)[:, None] * direction
        nearest[part] = closest
        off = np.linalg.norm(moved[part] - scan.points[closest], axis=1)
        distances[part] = np.where(own.any(axis=1), off, np.inf)

    for_parts(work, len(vertices))
    return moved, nearest, distances
