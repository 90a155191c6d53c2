"""The object as the user gave it, which tool paths are compared with: a mesh, or all points.

Paths on a scan are planned on a mesh that is made of its points. Compared with that alone, its own
errors would not be seen.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import cached_property
from typing import Protocol

import igl
import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import tangent_frames, unit_vectors
from nrdf.geometry.mesh import row_keys
from nrdf.geometry.quadrics import quadrics
from nrdf.io.cloud import PointCloud
from nrdf.surface.dense_normals import dense_normals
from nrdf.surface.target_mesh import TargetMesh

log = logging.getLogger(__name__)

_NEIGHBOURS, _LEAST = 24, 6  # points that the surface between them is fitted to
_FACING, _ALIKE = 0.2, 0.7  # cosines: to the tool's axis; between normals of one sheet
_SPACING_BY = 7  # the neighbour whose distance gives the spacing of points
_GAP = 1.5  # spacings to the next point within which the surface is taken to go on
_SMALLEST = 1e-9  # longest side of a mesh, m, that distances can be told on
_CHUNK = 1 << 14
_ASKED = 500  # points whose spacing stands for that of all


class GivenSurface(Protocol):
    """name: what distances are measured to, in words. resolution_m: distances below say nothing:
    0 for a mesh, half of the distance between a cloud's points."""

    name: str

    @property
    def resolution_m(self) -> float: ...

    def distance(self, places: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Distances (m,), m, of places (m, 3) where a tool with z at axes (m, 3), unit, works."""


def given_surface(cloud: PointCloud, mesh: TargetMesh | None = None) -> GivenSurface:
    """The surface of a cloud in metres, with normals: that of the mesh that it was sampled from,
    else that of all of its points.

    mesh: the outer skin of the cloud's mesh, where it is known (`nrdf.surface.object_mesh`). It is
    never one that was made of points: those themselves are what was given.
    """
    if cloud.mesh is not None:
        try:
            skin = TargetMesh.from_mesh(cloud.mesh) if mesh is None else mesh
            if skin.size < _SMALLEST:
                raise ProcessError(f"the mesh measures {skin.size:g} m")
            return MeshSurface(skin.vertices, skin.faces)
        except ProcessError as error:
            log.warning("distances are measured to the object's points: %s", error)
    assert cloud.normals is not None  # the caller's to see to
    return PointSurface(cloud.points, cloud.normals)


def with_normals_of(whole: PointCloud, cloud: PointCloud) -> PointCloud:
    """A cloud with normals by those of another one, where it has none of its own."""
    if whole.normals is not None or cloud.normals is None:
        return whole
    normals = dense_normals(whole.points, cloud.points, cloud.normals, whole.sensors)
    return replace(whole, normals=normals)


class MeshSurface:
    """The triangles themselves. vertices: (v, 3), m, finite; faces: (f, 3), each with an area."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        self.name = f"the mesh as given ({len(faces)} triangles)"
        self.resolution_m = 0.0
        self._origin = vertices.mean(axis=0)
        self._scale = float(np.ptp(vertices, axis=0).max())
        self._vertices = np.ascontiguousarray((vertices - self._origin) / self._scale)
        self._faces = np.ascontiguousarray(faces, dtype=np.int64)

    @cached_property
    def _tree(self) -> igl.AABB:
        tree = igl.AABB()
        tree.init(self._vertices, self._faces)
        return tree

    def distance(self, places: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Distances (m,), m, to the nearest triangle, whichever side it faces."""
        if not len(places):
            return np.zeros(0)
        asked = np.ascontiguousarray((places - self._origin) / self._scale)
        squared = self._tree.squared_distance(self._vertices, self._faces, asked)[0]
        return np.asarray(self._scale * np.sqrt(np.maximum(squared, 0.0)))


class PointSurface:
    """The surface between all points of a cloud: a quadric through the nearest ones that face the
    tool. points, normals: (n, 3), m, unit, outward.

    A place beyond the last point, or in a gap, is as far off as the surface's end is.
    """

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        self.name = f"all {len(points)} points as given"
        # Merged scans repeat points, which then have no distance to their neighbours.
        once = np.unique(row_keys(np.hstack([points, normals])), return_index=True)[1]
        self._points, self._normals = points[once], normals[once]
        self._tree = cKDTree(self._points, balanced_tree=False, compact_nodes=False)

    @cached_property
    def resolution_m(self) -> float:
        some = np.linspace(0, len(self._points) - 1, _ASKED).astype(int)
        return 0.5 * float(np.median(self._spacing_at(some)))

    def distance(self, places: np.ndarray, axes: np.ndarray) -> np.ndarray:
        """Distances (m,), m; to the nearest point where none around faces the tool."""
        parts = [np.zeros(0)]
        for start in range(0, len(places), _CHUNK):
            part = slice(start, start + _CHUNK)
            parts.append(self._distance(places[part], axes[part]))
        return np.concatenate(parts)

    def _distance(self, places: np.ndarray, axes: np.ndarray) -> np.ndarray:
        count = np.arange(1, min(_NEIGHBOURS, len(self._points)) + 1)
        away, near = self._tree.query(places, count)
        facing = -np.einsum("mka,ma->mk", self._normals[near], axes) > _FACING
        row = np.arange(len(places))
        first = facing.argmax(axis=1)  # the nearest that faces the tool
        own = self._normals[near[row, first]]
        sheet = facing & (np.einsum("mka,ma->mk", self._normals[near], own) > _ALIKE)
        reach = np.where(sheet, away, 0.0).max(axis=1, keepdims=True)
        weight = sheet * np.maximum(1.0 - (away / (1.05 * reach + 1e-12)) ** 2, 0.0) ** 2
        nearest = np.where(facing.any(axis=1), away[row, first], away[:, 0])
        offset = self._points[near] - places[:, None]
        # Along the sheet's own normal; the fit's slope is small, and so left out.
        outward = unit_vectors(np.einsum("mk,mka->ma", weight, self._normals[near]))
        known = np.abs(outward).max(axis=1, keepdims=True) > 0.0
        frame = tangent_frames(np.where(known, outward, own))
        turned = offset @ frame.transpose(0, 2, 1)
        spacing = self._spacing_at(near[row, first])
        scaled = turned[..., :2] / spacing[:, None, None]
        height = quadrics(scaled, turned[..., 2:], weight)[:, 0, 0]
        # Of few, as on thin parts, a plane: as their normals have it.
        total = np.maximum(weight.sum(axis=1), 1e-12)
        plane = (weight * turned[..., 2]).sum(axis=1) / total
        height = np.abs(np.where(sheet.sum(axis=1) >= _LEAST, height, plane))
        sideways = np.linalg.norm(turned[row, first, :2], axis=1)
        beyond = np.maximum(sideways - _GAP * spacing, 0.0)
        fitted = np.minimum(np.hypot(height, beyond), nearest)
        return np.asarray(np.where(facing.any(axis=1), fitted, nearest))

    def _spacing_at(self, index: np.ndarray) -> np.ndarray:
        """The distance (m,), m, between points around those at `index` (m,)."""
        number = min(_SPACING_BY, len(self._points) - 1)
        if number == 0:
            return np.full(len(index), 1e-9)
        which, back = np.unique(index, return_inverse=True)
        away = self._tree.query(self._points[which], [number + 1])[0][:, 0]
        # The side of the square that each has to itself.
        return np.asarray(np.maximum(away * np.sqrt(np.pi / number), 1e-9)[back.reshape(-1)])
