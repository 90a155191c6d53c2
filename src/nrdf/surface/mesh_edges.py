"""How the faces of a triangle mesh hang together: neighbours, parts, border loops."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


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


def edge_components(faces: np.ndarray, kind: np.ndarray | None = None) -> np.ndarray:
    """Number (f,), from 0, of the part of the mesh that each face belongs to, across edges.

    kind: (f,); with it, faces of different kinds belong to different parts.
    """
    opposite = opposite_half_edges(faces)
    inner = np.flatnonzero(opposite >= 0)
    if kind is not None:
        inner = inner[kind[inner // 3] == kind[opposite[inner] // 3]]
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
