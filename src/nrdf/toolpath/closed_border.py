"""Where a tool's pad could tip over a region's border: the border of the region, closed.

The morphological closing by a disc of the tool's radius (Serra 1982): a place of the border counts
only if a disc beside it is empty of the region. Gaps that are narrower than the tool, as between
slats, and the hollows between the ragged teeth of a scan then are no border.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

_PER_RADIUS = 8.0  # places of the border along the tool's radius
_DIRECTIONS = 32  # in which discs are laid about a place
_EMPTY = 0.95  # radii: an empty disc has nothing of the region nearer to its centre
_NEIGHBOURS, _ALIKE = 64, 0.7
_OTHER_SIDE = 0.5  # radii that opposite sides of a sheet are taken apart: neither fills a gap


@dataclass(frozen=True, eq=False)
class ClosedBorder:
    """Centres (c, 3), m, of discs beside a region, of the tool's radius, that are empty of it and
    touch its border. None of them: the region has no border, or none that a tool could tip over.
    """

    centres: np.ndarray
    radius_m: float

    @staticmethod
    def of(region: RegionMesh, tool_radius_m: float) -> ClosedBorder:
        """Discs about the border of a region, in planes that touch it there."""
        make = ClosedBorder._of
        return region.last("closed border", tool_radius_m, lambda: make(region, tool_radius_m))

    @staticmethod
    def _of(region: RegionMesh, tool_radius_m: float) -> ClosedBorder:
        mesh, radius = region.mesh, tool_radius_m
        border, along, faces = _places(mesh, radius / _PER_RADIUS)
        if not len(border):
            return ClosedBorder(np.zeros((0, 3)), radius)
        normals = _steady(border, mesh.smooth_normals(border, faces, radius), radius)
        one = unit_vectors(along - np.einsum("na,na->n", along, normals)[:, None] * normals)
        angle = (2.0 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS))[:, None, None]
        aside = np.cos(angle) * one + np.sin(angle) * np.cross(normals, one)
        centres = (border + radius * aside).reshape(-1, 3)
        outward = np.tile(normals, (_DIRECTIONS, 1))
        # The border itself tells of most discs that they are not empty, and quickly.
        apart = _OTHER_SIDE * radius
        tree = cKDTree(np.hstack([border, apart * normals]))
        asked = np.hstack([centres, apart * outward])
        least = _EMPTY * radius
        empty = np.isinf(tree.query(asked, distance_upper_bound=least)[0])
        centres, outward = centres[empty], outward[empty]
        return ClosedBorder(centres[mesh.nearest(centres, outward).distances >= least], radius)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """How far (m,) points (m, 3) of the region are from it, m, at least; infinite where there
        is no such border.

        Straight through the air: along a surface that bends it is no shorter.
        """
        if not len(self.centres):
            return np.full(len(points), np.inf)
        return np.asarray(cKDTree(self.centres).query(points)[0] - self.radius_m)


def _steady(places: np.ndarray, normals: np.ndarray, radius_m: float) -> np.ndarray:
    """Normals (n, 3) at places (n, 3) of a border, averaged over those within the tool's radius.

    On the ragged border of a scan some look far aside. Where a border's own sides look different
    ways, as at a pipe's end, they stay.
    """
    away, near = cKDTree(places).query(places, _NEIGHBOURS, distance_upper_bound=radius_m)
    there = np.isfinite(away)
    mean = (normals[np.where(there, near, 0)] * there[:, :, None]).sum(axis=1)
    alike = np.linalg.norm(mean, axis=1) > _ALIKE * there.sum(axis=1)
    return np.where(alike[:, None], unit_vectors(mean), normals)


def _places(mesh: TargetMesh, apart_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 3), m, on a mesh's border, no farther apart, the way (n, 3) of their edges, and
    the faces (n,) that they are on."""
    alone = np.flatnonzero(opposite_half_edges(mesh.faces) < 0)
    start = mesh.vertices[mesh.faces.reshape(-1)[alone]]
    way = mesh.vertices[np.roll(mesh.faces, -1, axis=1).reshape(-1)[alone]] - start
    length = np.linalg.norm(way, axis=1)
    alone, start, way, length = (each[length > 0.0] for each in (alone, start, way, length))
    count = np.ceil(length / apart_m).astype(int)
    edge = np.repeat(np.arange(len(alone)), count)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    places = start[edge] + (number / count[edge])[:, None] * way[edge]
    return places, way[edge], alone[edge] // 3
