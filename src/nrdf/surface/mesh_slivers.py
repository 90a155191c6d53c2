"""Triangles that are nearly lines, as cuts leave them: taken out without moving the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.geometry.mesh import triangle_crosses
from nrdf.surface.mesh_edges import opposite_half_edges

_SHORT, _FLAT = 1e-6, 2e-6  # longest sides: edges, and heights of triangles, that go
_ROUNDS = 12


def without_slivers(
    vertices: np.ndarray, faces: np.ndarray, origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same surface to two millionths of its size without needles and flat triangles.

    origin: (f,), where each face came from. Returns vertices, faces and origins.
    """
    size = float(np.ptp(vertices, axis=0).max())
    bad = _Thin.of(vertices, faces, size).any
    for _ in range(_ROUNDS):
        if not bad.any():
            break
        # Only these change, and faces around them.
        touched = np.zeros(len(vertices), bool)
        touched[faces[bad]] = True
        near = touched[faces].any(axis=1)
        around, sources = faces[near], origin[near]
        thin = _Thin.of(vertices, around, size)
        before, changed = len(around), 0
        if thin.short.any():
            around, sources = _merged(around, sources, thin.short)
        else:
            around, sources, changed = _flipped(around, sources, thin.flat, thin.longest)
        if not changed and len(around) == before:
            break
        faces = np.concatenate([faces[~near], around])
        origin = np.concatenate([origin[~near], sources])
        bad = np.zeros(len(faces), bool)
        bad[len(faces) - len(around) :] = _Thin.of(vertices, around, size).any
    return vertices, faces, origin


@dataclass(frozen=True)
class _Thin:
    """Which sides (f, 3) of faces are short; which faces (f,) are flat, and which of their sides
    are the longest (f,)."""

    short: np.ndarray
    flat: np.ndarray
    longest: np.ndarray

    @staticmethod
    def of(vertices: np.ndarray, faces: np.ndarray, size: float) -> _Thin:
        corners = vertices[faces]
        sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        double = np.linalg.norm(triangle_crosses(vertices, faces), axis=1)
        flat = double < _FLAT * size * sides.max(axis=1)
        return _Thin(sides < _SHORT * size, flat, sides.argmax(axis=1))

    @property
    def any(self) -> np.ndarray:
        return np.asarray(self.flat | self.short.any(axis=1))


def _merged(
    faces: np.ndarray, origin: np.ndarray, short: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """With the ends of short edges (f, 3) as one."""
    used, local = np.unique(faces, return_inverse=True)
    local = local.reshape(-1, 3)
    one, two = local[short], np.roll(local, -1, axis=1)[short]
    links = coo_matrix((np.ones(len(one), bool), (one, two)), (len(used), len(used)))
    label = connected_components(links, directed=False)[1]
    first = np.zeros(int(label.max()) + 1, np.int64)
    first[label] = np.arange(len(used))
    faces = used[first[label][local]]
    good = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return faces[good], origin[good]


def _flipped(
    faces: np.ndarray, origin: np.ndarray, flat: np.ndarray, longest: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Flat faces (f,) turned about their longest sides, so that the face beyond is divided at the
    flat one's third corner. Those at a border go."""
    thin = np.flatnonzero(flat)
    half = 3 * thin + longest[thin]
    other = opposite_half_edges(faces)[half]
    gone = thin[other < 0]
    thin, half, other = (one[other >= 0] for one in (thin, half, other))
    beyond = other // 3
    good = ~flat[beyond]
    _, first = np.unique(beyond[good], return_index=True)
    chosen = np.flatnonzero(good)[first]
    thin, half, other, beyond = (one[chosen] for one in (thin, half, other, beyond))
    a, b, c = (faces[thin, (half + k) % 3] for k in range(3))
    d = faces[beyond, (other + 2) % 3]
    fine = c != d
    thin, beyond, a, b, c, d = (one[fine] for one in (thin, beyond, a, b, c, d))
    faces, origin = faces.copy(), origin.copy()
    faces[beyond] = np.stack([b, c, d], axis=1)
    faces[thin] = np.stack([c, a, d], axis=1)
    origin[thin] = origin[beyond]
    kept = np.ones(len(faces), bool)
    kept[gone] = False
    return faces[kept], origin[kept], len(thin)
