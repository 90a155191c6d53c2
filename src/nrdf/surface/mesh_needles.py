"""Triangles without area that no turned edge can mend: one of their sides is taken out."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.mesh import triangle_crosses

_FLAT = 2e-7  # longest sides, the height up to which a triangle counts as a line
_OFF = 4e-6  # longest sides that the surface may move
_ALIKE = 0.9  # least cosine between a face's normal before and after
_MOST, _ROUNDS = 5_000, 3  # such triangles that are worked on, and times


def without_needles(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same surface, to some millionths of its size, without triangles that are lines.

    A vertex of each is moved to the next one where the faces around stay in their planes; a
    triangle that has no such side is removed. Returns faces, where each came from (f,), and a mask
    (f,) of the given faces that were removed and left a crack of no width.
    """
    size = float(np.ptp(vertices, axis=0).max())
    faces = faces.copy()
    there = np.ones(len(faces), bool)
    flat = _flat(vertices, faces, size)
    if not flat.any():
        return faces, np.arange(len(faces)), ~there
    around = _Around(faces)
    for _ in range(_ROUNDS if flat.sum() <= _MOST else 0):
        before = int(flat.sum())
        for face in np.flatnonzero(flat):
            if there[face] and _flat(vertices, faces[face : face + 1], size)[0]:
                _collapse(vertices, faces, there, around, int(face), size)
        flat = there & _flat(vertices, faces, size)
        if not flat.any() or flat.sum() == before:
            break
    kept = np.flatnonzero(there & ~flat)
    return faces[kept], kept, flat


class _Around:
    """The faces around each vertex, as they were at first and as they have been joined since."""

    def __init__(self, faces: np.ndarray) -> None:
        order = np.argsort(faces.reshape(-1), kind="stable")
        self._face = order // 3
        count = np.bincount(faces.reshape(-1))
        self._start = np.concatenate([[0], np.cumsum(count)])
        self._joined: dict[int, np.ndarray] = {}

    def of(self, vertex: int) -> np.ndarray:
        if vertex in self._joined:
            return self._joined[vertex]
        return self._face[self._start[vertex] : self._start[vertex + 1]]

    def join(self, gone: int, kept: int) -> None:
        self._joined[kept] = np.union1d(self.of(kept), self.of(gone))


def _collapse(
    vertices: np.ndarray,
    faces: np.ndarray,
    there: np.ndarray,
    around: _Around,
    face: int,
    size: float,
) -> None:
    """Moves one corner of a face to another one, the nearest that may be."""
    corners = faces[face]
    sides = np.linalg.norm(vertices[corners] - vertices[np.roll(corners, -1)], axis=1)
    for k in np.argsort(sides):
        one, two = int(corners[k]), int(corners[(k + 1) % 3])
        for gone, kept in ((one, two), (two, one)):
            if _may(vertices, faces, there, around, gone, kept, size):
                ring = around.of(gone)
                ring = ring[there[ring]]
                faces[ring] = np.where(faces[ring] == gone, kept, faces[ring])
                there[ring] = (np.diff(np.sort(faces[ring], axis=1), axis=1) > 0).all(axis=1)
                around.join(gone, kept)
                return


def _may(
    vertices: np.ndarray,
    faces: np.ndarray,
    there: np.ndarray,
    around: _Around,
    gone: int,
    kept: int,
    size: float,
) -> bool:
    """Whether a vertex may move to another one: the mesh stays a surface, and where it is."""
    ring, other = around.of(gone), around.of(kept)
    ring, other = ring[there[ring]], other[there[other]]
    shared = (faces[ring] == kept).any(axis=1)
    beside, count = np.unique(faces[ring], return_counts=True)
    open_ends = beside[(count == 1) & (beside != gone)]  # of a border
    common = np.intersect1d(beside, np.unique(faces[other]))
    if len(common) != 2 + shared.sum() or (count[beside != gone] > 2).any():
        return False
    if len(open_ends):
        if len(open_ends) != 2 or kept not in open_ends:
            return False
        start, end = vertices[open_ends]
        off = np.linalg.norm(np.cross(end - start, vertices[gone] - start))
        if off > _OFF * size * max(float(np.linalg.norm(end - start)), 1e-300):
            return False
    elif shared.sum() != 2:
        return False
    before = faces[ring[~shared]]
    after = np.where(before == gone, kept, before)
    was, now = triangle_crosses(vertices, before), triangle_crosses(vertices, after)
    was_flat, is_flat = _flat(vertices, before, size), _flat(vertices, after, size)
    if (is_flat & ~was_flat).any():
        return False
    real = ~is_flat & ~was_flat
    length = np.linalg.norm(now, axis=1)
    off = np.abs(now @ (vertices[gone] - vertices[kept]))
    cosine = np.einsum("fa,fa->f", was, now)
    alike = cosine > _ALIKE * np.linalg.norm(was, axis=1) * length
    return bool((alike | ~real).all() and (off[real] <= _OFF * size * length[real]).all())


def _flat(vertices: np.ndarray, faces: np.ndarray, size: float) -> np.ndarray:
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    crossed = np.linalg.norm(triangle_crosses(vertices, faces), axis=1)
    return np.asarray(crossed <= _FLAT * size * longest)
