"""Triangle meshes refined and cut along a curve, without changing the surface itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

_MOST_ROUNDS = 24  # each halves edges
_NO_NEEDLE = 0.02  # share of an edge that a cut leaves at least on either side


@dataclass(frozen=True)
class FineMesh:
    """A mesh made of pieces of another's faces: vertices (v, 3), faces (f, 3), and the face of the
    other mesh that each came from, origin (f,)."""

    vertices: np.ndarray
    faces: np.ndarray
    origin: np.ndarray

    @property
    def middles(self) -> np.ndarray:
        """(f, 3): the faces' middles."""
        return np.asarray(self.vertices[self.faces].mean(axis=1))

    @property
    def radii(self) -> np.ndarray:
        """(f,): the faces' longest edges."""
        corners = self.vertices[self.faces]
        away = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        return np.asarray(away.max(axis=1, initial=0.0))

    @property
    def areas(self) -> np.ndarray:
        """(f,): the faces' areas."""
        a, b, c = (self.vertices[corner] for corner in self.faces.T)
        return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0)

    def of_faces(self, chosen: np.ndarray) -> FineMesh:
        """The chosen faces (a mask or indices) with the vertices that they use."""
        used, faces = np.unique(self.faces[chosen], return_inverse=True)
        return FineMesh(self.vertices[used], faces.reshape(-1, 3), self.origin[chosen])


def refine(
    mesh: FineMesh,
    longest_edge: float,
    wanted: Callable[[np.ndarray, np.ndarray], np.ndarray],
    most_faces: int,
) -> FineMesh:
    """Edges halved until none is longer than `longest_edge` where `wanted`.

    wanted: from the middles (f, 3) and the radii (f,) of faces, which of them matter. Faces that
    share an edge still share it afterwards. Stops at about `most_faces`.
    """
    vertices, faces, origin = mesh.vertices, mesh.faces, mesh.origin
    for _ in range(_MOST_ROUNDS):
        corners = vertices[faces]
        lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
        asked = np.flatnonzero(lengths.max(axis=1) > longest_edge)
        asked = asked[wanted(corners[asked].mean(axis=1), lengths[asked].max(axis=1))]
        if not len(asked) or len(faces) > most_faces:
            break
        tail, head = faces, np.roll(faces, -1, axis=1)
        key = np.minimum(tail, head) * len(vertices) + np.maximum(tail, head)
        # The longest edges first: needles become strips, not finer needles.
        long = lengths[asked] > np.maximum(
            longest_edge, 0.6 * lengths[asked].max(axis=1, keepdims=True)
        )
        halved = np.unique(key[asked][long])
        number = np.minimum(np.searchsorted(halved, key), len(halved) - 1)
        middle = np.where(halved[number] == key, len(vertices) + number, -1)
        ends = np.stack(np.divmod(halved, len(vertices)), axis=1)
        vertices = np.concatenate([vertices, vertices[ends].mean(axis=1)])
        faces, origin = _divided(faces, middle, vertices, origin)
    return FineMesh(vertices, faces, origin)


def _divided(
    faces: np.ndarray, middle: np.ndarray, vertices: np.ndarray, origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Faces (f, 3) divided at the new vertices on their edges, `middle` (f, 3), -1 for none."""
    count = (middle >= 0).sum(axis=1)
    parts, whole = [faces[count == 0]], [np.flatnonzero(count == 0)]

    def turned(which: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        order = (start[:, None] + np.arange(3)) % 3
        row = which[:, None]
        return faces[row, order].T, middle[row, order].T

    def add(which: np.ndarray, *corners: np.ndarray) -> None:
        parts.append(np.stack(corners, axis=1))
        whole.append(which)

    one = np.flatnonzero(count == 1)
    (a, b, c), (ab, _, _) = turned(one, (middle[one] >= 0).argmax(axis=1))
    add(one, a, ab, c)
    add(one, ab, b, c)
    two = np.flatnonzero(count == 2)
    (a, b, c), (ab, bc, _) = turned(two, ((middle[two] < 0).argmax(axis=1) + 1) % 3)
    add(two, ab, b, bc)
    # The shorter diagonal of the four-sided rest a, ab, bc, c.
    first = np.linalg.norm(vertices[ab] - vertices[c], axis=1)
    short = first < np.linalg.norm(vertices[a] - vertices[bc], axis=1)
    add(two, a, ab, np.where(short, c, bc))
    add(two, np.where(short, ab, a), bc, c)
    three = np.flatnonzero(count == 3)
    (a, b, c), (ab, bc, ca) = turned(three, np.zeros(len(three), np.int64))
    for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)):
        add(three, *corners)
    return np.concatenate(parts), origin[np.concatenate(whole)]


def cut(
    mesh: FineMesh, inside: np.ndarray, crossing: Callable[[np.ndarray], np.ndarray]
) -> tuple[FineMesh, np.ndarray]:
    """Faces divided where some of their vertices are `inside` (v,), and which faces (f,) are.

    crossing: from edges (e, 2) of vertex indices, an inner one first, the share (e,) of the way
    from the first to the second that lies inside.
    """
    faces = mesh.faces
    within = inside[faces]
    mixed = np.flatnonzero(within.any(axis=1) & ~within.all(axis=1))
    rest = np.flatnonzero(within.all(axis=1) | ~within.any(axis=1))
    if not len(mixed):
        return mesh, within[:, 0]
    # The corner that is alone on its side first.
    alone = within[mixed].sum(axis=1) == 1
    lone = (within[mixed] == alone[:, None]).argmax(axis=1)
    a, b, c = faces[mixed[:, None], (lone[:, None] + np.arange(3)) % 3].T
    ends = np.concatenate([np.stack([a, b], axis=1), np.stack([a, c], axis=1)])
    ends = np.where(inside[ends[:, :1]], ends, ends[:, ::-1])
    count = len(mesh.vertices)
    key, number = np.unique(ends[:, 0] * count + ends[:, 1], return_inverse=True)
    ends = np.stack(np.divmod(key, count), axis=1)
    share = np.clip(crossing(ends), _NO_NEEDLE, 1.0 - _NO_NEEDLE)[:, None]
    places = (1.0 - share) * mesh.vertices[ends[:, 0]] + share * mesh.vertices[ends[:, 1]]
    ab, ac = (count + number.reshape(2, -1)).astype(faces.dtype)
    cut_faces = [faces[rest], np.stack([a, ab, ac], 1), np.stack([ab, b, c], 1)]
    cut_faces.append(np.stack([ab, c, ac], 1))
    sides = np.concatenate([within[rest, 0], alone, ~alone, ~alone])
    origin = np.concatenate([rest, mixed, mixed, mixed])
    fine = FineMesh(
        np.concatenate([mesh.vertices, places]), np.concatenate(cut_faces), mesh.origin[origin]
    )
    return fine, sides


def bisected(
    starts: np.ndarray, ends: np.ndarray, inside: Callable[[np.ndarray], np.ndarray], rounds: int
) -> np.ndarray:
    """Share (e,) of the way from starts (e, 3), inside, to ends (e, 3), outside, at which that
    changes, found by halving; inside: of places (e, 3), (e,) bool."""
    low, high = np.zeros(len(starts)), np.ones(len(starts))
    for _ in range(rounds):
        half = (low + high) / 2.0
        within = inside(starts + half[:, None] * (ends - starts))
        low, high = np.where(within, half, low), np.where(within, high, half)
    return (low + high) / 2.0
