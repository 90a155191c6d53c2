"""Parts of regions on a mesh that are too small for a tool: specks go, holes are filled."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.surface.fine_mesh import FineMesh
from nrdf.surface.mesh_edges import opposite_half_edges

_ALIKE = 0.5  # least cosine between a hole and the region around it
_TOUCH, _APART = 1e-5, 1e-5  # longest sides within which parts touch, if they look the same way


class Pieces:
    """The parts of regions, masks (f,) of a mesh's faces, and of what they leave.

    regions: (r, f) bool; with them, every mask that is asked about follows their borders, and the
    answer is found sooner.
    """

    def __init__(self, mesh: FineMesh, regions: np.ndarray | None = None) -> None:
        self._mesh = mesh
        self._size = float(np.ptp(mesh.vertices, axis=0).max())
        opposite = opposite_half_edges(mesh.faces)
        half = np.flatnonzero(opposite >= 0)
        self._pairs = np.stack([half // 3, opposite[half] // 3], axis=1)
        self._at_border = np.unique(np.flatnonzero(opposite < 0) // 3)
        # Patches (f,) that no border leads through, and which of them meet.
        self._patch = np.arange(len(mesh.faces))
        if regions is not None:
            kind = np.zeros(len(mesh.faces), np.int64)
            for inside in regions:
                kind = np.unique(2 * kind + inside, return_inverse=True)[1].reshape(-1)
            same = kind[self._pairs[:, 0]] == kind[self._pairs[:, 1]]
            self._patch = _joined(self._pairs[same], len(mesh.faces))
        self._face = np.unique(self._patch, return_index=True)[1]
        meet = self._patch[self._pairs]
        self._patch_pairs = np.unique(meet[meet[:, 0] != meet[:, 1]], axis=0)

    def without_specks(
        self, inside: np.ndarray, footprint: float
    ) -> tuple[np.ndarray, list[float]]:
        """A region (f,) without parts smaller than a footprint (m²), and the areas of those.

        Parts that touch, facing the same way, count as one: not all meshes are sewn together.
        """
        chosen = np.flatnonzero(inside)
        number = self._parts(inside)[chosen]
        areas = self._mesh.areas[chosen]
        names, number = np.unique(number, return_inverse=True)
        if (np.bincount(number, areas) >= footprint).all():
            return inside, []
        group = self._touching(chosen, number, len(names))[number]
        area = np.bincount(group, areas)
        small = area < footprint
        kept = inside.copy()
        kept[chosen[small[group]]] = False
        return kept, [float(a) for a in area[small]]

    def without_holes(
        self, inside: np.ndarray, taken: np.ndarray, largest: float
    ) -> tuple[np.ndarray, list[float], list[float]]:
        """A region (f,) with holes up to an area (m²) filled, their areas, and those of the others.

        A hole is a part of the rest that only one part of the region surrounds, is smaller than
        that, looks the same way, and has nothing that is taken (f,).
        """
        number = self._parts(inside)
        areas = self._mesh.areas
        area = np.bincount(number, areas)
        of_region = np.zeros(len(area), bool)
        of_region[number[inside]] = True
        here, there = number[self._pairs].T
        meet = ~of_region[here] & of_region[there]
        pairs = np.unique(np.stack([here[meet], there[meet]], axis=1), axis=0)
        closed = np.bincount(pairs[:, 0], minlength=len(area)) == 1
        closed[number[self._at_border]] = False
        closed[number[taken]] = False
        pairs = pairs[closed[pairs[:, 0]] & (area[pairs[:, 0]] <= area[pairs[:, 1]])]
        if not len(pairs):
            return inside, [], []
        # Which way a hole looks, and the region along its border.
        facing, along = np.zeros((2, len(area), 3))
        weighted = areas[:, None] * self._mesh.normals
        beside = self._pairs[meet, 1]
        for axis in range(3):
            facing[:, axis] = np.bincount(number, weighted[:, axis])
            along[:, axis] = np.bincount(here[meet], weighted[beside, axis], len(area))
        holes = pairs[:, 0]
        cosine = np.einsum("ha,ha->h", facing[holes], along[holes])
        lengths = np.linalg.norm(facing[holes], axis=1) * np.linalg.norm(along[holes], axis=1)
        holes = holes[cosine > _ALIKE * lengths]
        filled = holes[area[holes] <= largest]
        kept = holes[area[holes] > largest]
        whole = inside | np.isin(number, filled)
        return whole, [float(a) for a in area[filled]], [float(a) for a in area[kept]]

    def _parts(self, inside: np.ndarray) -> np.ndarray:
        """Number (f,) of the part that each face is of, across edges, inside or outside."""
        of_patch = inside[self._face]
        one, two = self._patch_pairs.T
        pairs = self._patch_pairs[of_patch[one] == of_patch[two]]
        return np.asarray(_joined(pairs, len(of_patch))[self._patch])

    def _touching(self, chosen: np.ndarray, number: np.ndarray, count: int) -> np.ndarray:
        """Group (count,) of each part of the chosen faces: parts of its side that it touches."""
        mesh = self._mesh
        rows = np.isin(chosen, self._at_border)
        faces = chosen[rows]
        away = _APART * self._size * np.repeat(mesh.normals[faces], 3, axis=0)
        tree = cKDTree(np.hstack([mesh.vertices[mesh.faces[faces].reshape(-1)], away]))
        pairs = tree.query_pairs(_TOUCH * self._size, output_type="ndarray")
        one, two = np.repeat(number[rows], 3)[pairs.T]
        return _joined(np.stack([one, two], axis=1), count)


def _joined(pairs: np.ndarray, count: int) -> np.ndarray:
    """Number (count,) of the group that each belongs to, by pairs (k, 2) of one group."""
    links = coo_matrix((np.ones(len(pairs), bool), tuple(pairs.T)), (count, count))
    return np.asarray(connected_components(links, directed=False)[1])
