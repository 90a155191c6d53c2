"""The surface that paths are planned on: an object's outer skin as triangles, faces outward."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from threading import RLock
from typing import Any

import igl
import numpy as np

from nrdf.errors import DataError, ProcessError
from nrdf.geometry.frames import SIDES, unit_vectors
from nrdf.geometry.mesh import Mesh, triangle_crosses
from nrdf.geometry.winding import MeshWindingNumber
from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.mesh_repair import repaired_skin
from nrdf.surface.smooth_normals import SmoothNormals

_FACING = 0.5  # least cosine between a face's normal and the side asked for


@dataclass(frozen=True)
class NearestPoints:
    """Places on a mesh (m, 3), m; the faces (m,) that they lie on, with outward unit normals
    (m, 3); how far they are, distances (m,), m."""

    points: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    distances: np.ndarray


@dataclass(frozen=True, eq=False)
class TargetMesh:
    """vertices: (v, 3) float64, m. faces: (f, 3) vertex indices, outward. repairs: what was changed
    of the mesh that was given, in words."""

    vertices: np.ndarray
    faces: np.ndarray
    repairs: tuple[str, ...] = ()
    _found: dict[Any, Any] = field(default_factory=dict, repr=False)
    _lock: Any = field(default_factory=RLock, repr=False)  # each search tree is built by one thread

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes: search trees stay here, and are built anew there."""
        return TargetMesh, (self.vertices, self.faces, self.repairs)

    @staticmethod
    def from_mesh(mesh: Mesh) -> TargetMesh:
        """The outer skin of a mesh in metres, at its own resolution.

        Equal vertices are merged; faces without area, repeated and hidden faces are removed; the
        others are turned outwards. Raises ProcessError for what is no surface.
        """
        try:
            vertices, faces, repairs = repaired_skin(mesh.vertices, mesh.faces)
        except DataError as error:
            raise ProcessError(f"no paths can be planned on this mesh: {error}") from error
        return TargetMesh(vertices, faces, repairs)

    @cached_property
    def face_normals(self) -> np.ndarray:
        """(f, 3): outward unit normals."""
        return unit_vectors(self._cross)

    @cached_property
    def face_areas(self) -> np.ndarray:
        """(f,), m²."""
        return np.asarray(np.linalg.norm(self._cross, axis=1) / 2.0)

    @cached_property
    def vertex_normals(self) -> np.ndarray:
        """(v, 3): outward unit normals, of the faces around weighted by their angles."""
        kind = igl.PER_VERTEX_NORMALS_WEIGHTING_TYPE_ANGLE
        normals = igl.per_vertex_normals(self.vertices, self.faces, kind)
        return unit_vectors(np.nan_to_num(np.asarray(normals)))

    @cached_property
    def edge_length(self) -> float:
        """Typical length of an edge, m: the median."""
        corners = self.vertices[self.faces]
        return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    @cached_property
    def border_length(self) -> float:
        """Length of all borders, m: of the edges of a single face."""
        start, stop = self.faces.reshape(-1), np.roll(self.faces, -1, axis=1).reshape(-1)
        alone = opposite_half_edges(self.faces) < 0
        way = self.vertices[start[alone]] - self.vertices[stop[alone]]
        return float(np.linalg.norm(way, axis=1).sum())

    @cached_property
    def size(self) -> float:
        """Longest side of the bounding box, m."""
        return float(np.ptp(self.vertices, axis=0).max())

    @cached_property
    def _cross(self) -> np.ndarray:
        return triangle_crosses(self.vertices, self.faces)

    def nearest(self, points: np.ndarray, outward: np.ndarray | None = None) -> NearestPoints:
        """The nearest places on the mesh to points (m, 3), m.

        outward: (m, 3). With it, the nearest place whose face looks that way (within 60°, and in
        any case within 90°), so that the two sides of a thin sheet are kept apart. Where no face
        of the mesh looks that way, the nearest place of all.
        """
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        if not len(points):
            return NearestPoints(points, np.zeros(0, np.int64), points, np.zeros(0))
        squared, faces, places = self._nearest_of_side(points, -1)
        if outward is not None:
            outward = unit_vectors(np.asarray(outward, dtype=np.float64))
            facing = np.einsum("ma,ma->m", self.face_normals[faces], outward)
            other = np.flatnonzero(facing < _FACING)
            side = (outward[other] @ SIDES.T).argmax(axis=1)
            for number in np.unique(side):
                asked = other[side == number]
                found = self._nearest_of_side(points[asked], int(number))
                squared[asked], faces[asked], places[asked] = found
        distances = np.sqrt(np.maximum(squared, 0.0))
        return NearestPoints(places, faces, self.face_normals[faces], distances)

    def _nearest_of_side(
        self, points: np.ndarray, side: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Squared distances (m,), faces (m,) and places (m, 3) on the faces that look to one of
        `SIDES`, or on all for -1."""
        with self._lock:
            if side not in self._found:
                self._found[side] = self._tree_of_side(side)
        tree, chosen, faces = self._found[side]
        squared, face, places = tree.squared_distance(self.vertices, faces, points)
        return np.array(squared), chosen[np.asarray(face)], np.array(places)

    def _tree_of_side(self, side: int) -> tuple[igl.AABB, np.ndarray, np.ndarray]:
        chosen = np.arange(len(self.faces))
        if side >= 0:
            facing = self.face_normals @ SIDES[side] > _FACING
            chosen = np.flatnonzero(facing) if facing.any() else chosen
        faces = np.ascontiguousarray(self.faces[chosen])
        tree = igl.AABB()
        tree.init(self.vertices, faces)
        return tree, chosen, faces

    def winding_numbers(self, points: np.ndarray) -> np.ndarray:
        """Winding numbers (m,) at points (m, 3), m: about 1 inside the object, 0 outside."""
        with self._lock:
            if "winding" not in self._found:
                self._found["winding"] = MeshWindingNumber(self.vertices, self.faces)
        return np.asarray(self._found["winding"](points))

    def first_hits(
        self, starts: np.ndarray, directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where rays from starts (m, 3), m, along unit directions (m, 3) first meet the mesh: the
        distances (m,), m, infinite for none, and the faces (m,), -1 for none."""
        if not len(starts):
            return np.zeros(0), np.zeros(0, np.int64)
        self._nearest_of_side(starts[:1], -1)
        tree, _, faces = self._found[-1]
        starts = np.ascontiguousarray(starts, dtype=np.float64)
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        face, far, _ = tree.intersect_ray_first(self.vertices, faces, starts, directions)
        face = np.asarray(face)
        return np.where(face < 0, np.inf, np.asarray(far)), face

    def smooth_normals(self, points: np.ndarray, faces: np.ndarray, radius_m: float) -> np.ndarray:
        """Outward unit normals (m, 3) at points (m, 3), m, on `faces` (m,): what a flat tool feels.

        The average over the area within `radius_m` whose normals turn less than 60° from the
        average itself, which is found from the face's own normal.
        """
        key = ("felt", radius_m)
        with self._lock:
            if key not in self._found:
                self._found[key] = SmoothNormals(self.vertices, self.faces, radius_m)
        return np.asarray(self._found[key](np.asarray(points), self.face_normals[faces]))

    def submesh(self, face_mask: np.ndarray) -> TargetMesh:
        """The faces of a mask (f,) with the vertices that they use."""
        used, faces = np.unique(self.faces[face_mask], return_inverse=True)
        return TargetMesh(self.vertices[used], faces.reshape(-1, 3), self.repairs)
