"""What a tool reaches from lines: points within its footprint that face it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part
from nrdf.toolpath.planners.level_lines import MeshLine, resampled
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_FACING = 0.5  # cosine between a point's normal and the tool's
_PER_RADIUS = 3.0  # places on a line along the tool's radius


def reached_from_lines(
    region: RegionMesh, part: Part, lines: Sequence[MeshLine], strategy: Strategy
) -> np.ndarray:
    """Which triangles (f,) of a part a footprint on lines of its mesh reaches."""
    mesh = part.mesh
    if not lines:
        return np.zeros(len(mesh.faces), bool)
    radius = strategy.tool_radius_m
    placed = [resampled(line, radius / _PER_RADIUS) for line in lines]
    places = np.concatenate([place for place, _ in placed])
    faces = mesh.origin[np.concatenate([face for _, face in placed])]
    normals = region.mesh.smooth_normals(places, faces, radius)
    return reached_by(mesh.centres, mesh.normals, places, normals, radius)


def reached_from_paths(part: Part, paths: Sequence[SurfacePath], radius_m: float) -> np.ndarray:
    """Which triangles (f,) of a part a footprint on paths beside it reaches."""
    mesh = part.mesh
    low, high = mesh.vertices.min(axis=0) - radius_m, mesh.vertices.max(axis=0) + radius_m
    near = [((path.contacts > low) & (path.contacts < high)).all(axis=1) for path in paths]
    places = [path.contacts[chosen] for path, chosen in zip(paths, near, strict=True)]
    outward = [path.normals[chosen] for path, chosen in zip(paths, near, strict=True)]
    if not any(map(len, places)):
        return np.zeros(len(mesh.faces), bool)
    return reached_by(
        mesh.centres, mesh.normals, np.concatenate(places), np.concatenate(outward), radius_m
    )


def reached_by(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    outward: np.ndarray,
    radius_m: float,
) -> np.ndarray:
    """Whether (m,) a tool at places (n, 3), upright on outward normals (n, 3), reaches points
    (m, 3) with normals (m, 3)."""
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(places), radius_m, output_type="ndarray")
    point, place = pairs["i"], pairs["j"]
    facing = np.einsum("pa,pa->p", normals[point], outward[place]) > _FACING
    reached = np.zeros(len(points), bool)
    reached[point[facing]] = True
    return reached
