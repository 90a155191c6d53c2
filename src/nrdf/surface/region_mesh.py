"""A region of a target mesh: its own faces, borders and parts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.errors import ProcessError
from nrdf.surface.target_mesh import TargetMesh


@dataclass(frozen=True, eq=False)
class RegionMesh:
    """mesh: the region's own faces, cut within triangles at its border. parent: the whole object.
    changes: what was done to the region that was found, in words."""

    mesh: TargetMesh
    parent: TargetMesh
    changes: tuple[str, ...] = ()

    @staticmethod
    def from_faces(target: TargetMesh, face_mask: np.ndarray) -> RegionMesh:
        """Whole faces of a target, chosen by a mask (f,). Raises ProcessError if there are none."""
        face_mask = np.asarray(face_mask)
        if face_mask.dtype != bool or face_mask.shape != (len(target.faces),):
            raise ProcessError(
                f"a region of faces is a mask of {len(target.faces)}, not {face_mask.dtype} of "
                f"{face_mask.shape}"
            )
        if not face_mask.any():
            raise ProcessError("a region must have at least one face of the target's mesh")
        return RegionMesh(target.submesh(face_mask), target)

    @property
    def area_m2(self) -> float:
        """The region's area, m²."""
        return float(self.mesh.face_areas.sum())

    @cached_property
    def boundary_loops(self) -> list[np.ndarray]:
        """Closed loops of vertex indices, the longest first: the outer border and holes.

        Each runs with the region on its left, seen from outside; the first vertex is not repeated.
        """
        loops = boundary_loops(self.mesh.faces)
        return sorted(loops, key=lambda loop: -self.loop_length(loop))

    def loop_length(self, loop: np.ndarray) -> float:
        """Length, m, of a closed loop of vertex indices (n,)."""
        places = self.mesh.vertices[loop]
        return float(np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1).sum())

    def components(self) -> list[RegionMesh]:
        """The parts that no edge connects, the largest first."""
        number = edge_components(self.mesh.faces)
        area = np.bincount(number, self.mesh.face_areas)
        order = np.argsort(-area, kind="stable")
        if len(order) == 1:
            return [self]
        parts = (self.mesh.submesh(number == part) for part in order)
        return [RegionMesh(part, self.parent, self.changes) for part in parts]


def opposite_half_edges(faces: np.ndarray) -> np.ndarray:
    """The half-edge (3 f,) that runs back along each half-edge, -1 at a border.

    Half-edge 3 i + k leads from corner k of face i to the next. Where more than two faces meet, or
    two that are wound differently, there is a border.
    """
    tail, head = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    count = int(faces.max(initial=0)) + 1
    key = np.minimum(tail, head) * count + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    start = np.flatnonzero(np.diff(key[order], prepend=-1))
    pairs = start[np.diff(start, append=len(key)) == 2]
    one, two = order[pairs], order[pairs + 1]
    good = tail[one] == head[two]
    one, two = one[good], two[good]
    opposite = np.full(len(key), -1)
    opposite[one], opposite[two] = two, one
    return opposite


def edge_components(faces: np.ndarray) -> np.ndarray:
    """Number (f,), from 0, of the part of the mesh that each face belongs to, across edges."""
    opposite = opposite_half_edges(faces)
    inner = np.flatnonzero(opposite >= 0)
    links = (np.ones(len(inner), bool), (inner // 3, opposite[inner] // 3))
    graph = coo_matrix(links, (len(faces), len(faces)))
    return np.asarray(connected_components(graph, directed=False)[1])


def boundary_loops(faces: np.ndarray) -> list[np.ndarray]:
    """Closed loops (n,) of the vertices along a mesh's borders, faces on their left."""
    opposite = opposite_half_edges(faces)
    border = np.flatnonzero(opposite < 0)
    if not len(border):
        return []

    def following(half: np.ndarray) -> np.ndarray:
        return half // 3 * 3 + (half + 1) % 3

    # The next half-edge of the border: turn about the head, through the faces around it.
    found = following(border)
    while len(inner := np.flatnonzero(opposite[found] >= 0)):
        found[inner] = following(opposite[found[inner]])
    place = np.full(len(opposite), -1)
    place[border] = np.arange(len(border))
    after = place[found].tolist()
    tail = faces.reshape(-1)[border]
    loops, seen = [], [False] * len(border)
    for first in range(len(border)):
        loop = []
        at = first
        while not seen[at]:
            seen[at] = True
            loop.append(at)
            at = after[at]
        if loop:
            loops.append(tail[loop])
    return loops
