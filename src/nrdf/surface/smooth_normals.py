"""What a flat tool feels: normals of a mesh, averaged under it."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import SIDES, unit_vectors
from nrdf.geometry.mesh import triangle_crosses
from nrdf.geometry.sampling import spread_in_triangles

_FACING = 0.5  # least cosine between a normal and the average that it is part of
_REACH = 1.5  # of the tool's radius, from where nothing is felt
_PER_RADIUS, _NEIGHBOURS = 2.5, 48  # patches along a tool's radius, and under the whole tool
_MOST_PATCHES = 200_000  # of a whole mesh
_PER_PATCH = 4.0  # places of a large face for each patch's square
_ROUNDS, _SETTLED = 8, 1e-3  # of an average that finds the side it faces, and its last turn, rad
_AT_ONCE = 1 << 15


class SmoothNormals:
    """Normals averaged over the area within a tool's reach, of all of a mesh or of a part of it.

    vertices: (v, 3), m; faces: (f, 3), outward. near: faces (k, 3) of these or other vertices
    (w, 3), m; then only what a tool on them feels is known.
    """

    def __init__(
        self,
        vertices: np.ndarray,
        faces: np.ndarray,
        radius_m: float,
        near: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> None:
        self._reach = _REACH * radius_m
        whole = 0.5 * float(_length(triangle_crosses(vertices, faces)).sum())
        size = max(radius_m / _PER_RADIUS, float(np.sqrt(whole / _MOST_PATCHES)))
        self._cells = None if near is None else _Cells(*near, self._reach + size)
        if self._cells is not None:
            faces = faces[self._cells.may_touch(vertices, faces)]
        cross = triangle_crosses(vertices, faces)
        double = _length(cross)
        real = double > 0.0  # needles have no side, and no middle that their area could weigh
        faces, cross, double = faces[real], cross[real], double[real]
        middles, face, areas = _places(vertices[faces], 0.5 * double, size)
        if self._cells is not None:
            close = self._cells.around(middles)
            middles, face, areas = middles[close], face[close], areas[close]
        normals = cross / double[:, None]
        side = (normals @ SIDES.T).argmax(axis=1)
        self._tree, self._weighted = _patches(middles, normals[face], side[face], areas, size)
        self._directions = unit_vectors(self._weighted)

    def known(self, points: np.ndarray) -> np.ndarray:
        """Whether all that a tool feels at points (m, 3), m, is here: (m,)."""
        return np.ones(len(points), bool) if self._cells is None else self._cells.within(points)

    def __call__(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """The average (m, 3), unit, around points (m, 3), m, over normals that turn less than 60°
        from the average itself; it is found from normals (m, 3), unit."""
        normals = np.array(normals, dtype=np.float64)
        for start in range(0, len(points) if self._tree.n else 0, _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            normals[part] = self._at_once(points[part], normals[part])
        return normals

    def _at_once(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        count = np.arange(1, min(_NEIGHBOURS, self._tree.n) + 1)
        away, near = self._tree.query(points, count, distance_upper_bound=self._reach)
        there = np.isfinite(away)
        near = np.where(there, near, 0)
        weight = np.where(there, np.maximum(1.0 - (away / self._reach) ** 2, 0.0) ** 2, 0.0)
        turning = np.arange(len(points))
        directions, weighted = self._directions[near], self._weighted[near]
        for _ in range(_ROUNDS):
            facing = np.einsum("mka,ma->mk", directions, normals[turning])
            share = weight * np.maximum(facing - _FACING, 0.0)
            mean = np.einsum("mk,mka->ma", share, weighted)
            found = np.where(mean.any(axis=1)[:, None], unit_vectors(mean), normals[turning])
            turned = _length(found - normals[turning]) > _SETTLED
            normals[turning] = found
            if not turned.any():
                break
            turning, weight = turning[turned], weight[turned]
            directions, weighted = directions[turned], weighted[turned]
        return normals


class _Cells:
    """Cubes of some size that faces (k, 3) of vertices (w, 3) lie in, and those around them."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, size: float) -> None:
        used = vertices[faces]
        self._low, self._size = used.reshape(-1, 3).min(axis=0) - 2.0 * size, size
        high = used.reshape(-1, 3).max(axis=0) + 2.0 * size
        self._count = np.ceil((high - self._low) / size).astype(np.int64)
        double = _length(triangle_crosses(vertices, faces))
        own = _places(used, 0.5 * double, 0.5 * size)[0]
        own = np.unique(self._key(np.concatenate([own, used.reshape(-1, 3)]))[0])
        step = np.arange(-1, 2)
        rows = (step[:, None] * self._count[1] + step).ravel()
        around = (rows[:, None] * self._count[2] + step).ravel()
        self._own, self._around = own, np.unique(own[:, None] + around)

    def within(self, points: np.ndarray) -> np.ndarray:
        """Whether points (m, 3) lie in the cubes of the faces themselves: (m,)."""
        return self._are_in(points, self._own)

    def around(self, points: np.ndarray) -> np.ndarray:
        """Whether points (m, 3) lie in those cubes, or in one beside them: (m,)."""
        return self._are_in(points, self._around)

    def may_touch(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Which faces (f,) are in the box of all cubes, in part."""
        above = (vertices >= self._low)[faces].any(axis=1).all(axis=1)
        below = (vertices <= self._low + self._size * self._count)[faces].any(axis=1).all(axis=1)
        return np.asarray(above & below)

    def _are_in(self, points: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        key, inside = self._key(points)
        return np.asarray(np.isin(key, chosen) & inside)

    def _key(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        cell = np.floor((points - self._low) / self._size).astype(np.int64)
        inside = ((cell >= 0) & (cell < self._count)).all(axis=1)
        return (cell[:, 0] * self._count[1] + cell[:, 1]) * self._count[2] + cell[:, 2], inside


def _places(
    corners: np.ndarray, areas: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (p, 3) that stand for triangles (f, 3, 3) with areas (f,), the triangle (p,) that each
    lies on, and the area (p,) that it stands for: the middle of a small triangle, and places spread
    over one with an edge longer than `size`."""
    edges = corners - np.roll(corners, -1, axis=1)
    large = (np.einsum("fka,fka->fk", edges, edges) > size**2).any(axis=1)
    count = np.ones(len(corners), np.int64)
    count[large] = np.maximum(np.ceil(_PER_PATCH * areas[large] / size**2), 1)
    face = np.repeat(np.arange(len(corners)), count)
    spread = large[face]
    places = np.empty((len(face), 3))
    places[~spread] = corners[face[~spread]].mean(axis=1)
    places[spread] = spread_in_triangles(corners[face[spread]])
    return places, face, (areas / count)[face]


def _patches(
    places: np.ndarray, normals: np.ndarray, side: np.ndarray, areas: np.ndarray, size: float
) -> tuple[cKDTree, np.ndarray]:
    """One patch for each cell of some size and each side (p,) that normals (p, 3) look to: a tree
    of the middles, and normals (k, 3) times area."""
    if not len(places):
        return cKDTree(np.zeros((0, 3))), np.zeros((0, 3))
    cell = np.floor((places - places.min(axis=0)) / size).astype(np.int64)
    # One number for each is sorted much faster than rows of four.
    count = cell.max(axis=0) + 1
    key = ((cell[:, 0] * count[1] + cell[:, 1]) * count[2] + cell[:, 2]) * len(SIDES) + side
    _, number = np.unique(key, return_inverse=True)
    number = number.reshape(-1)
    total = np.bincount(number, areas)
    centre = [np.bincount(number, areas * places[:, a]) / total for a in range(3)]
    weighted = [np.bincount(number, areas * normals[:, a]) for a in range(3)]
    return cKDTree(np.stack(centre, axis=1)), np.stack(weighted, axis=1)


def _length(rows: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ka,ka->k", rows, rows))
