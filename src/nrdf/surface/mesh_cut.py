"""Triangle meshes cut along a curve: where a function of their corners is zero."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nrdf.surface.fine_mesh import FineMesh, edges_of, split_edges

_NO_NEEDLE = 0.02  # share of an edge that a cut leaves at least on either side


def cut(mesh: FineMesh, level: np.ndarray, values: np.ndarray) -> tuple[FineMesh, np.ndarray]:
    """Faces divided where a function `level` (f, 3) of their corners changes its sign.

    The function may differ between the faces around a vertex. Faces that share an edge still share
    it afterwards. values: (f, 3, k), other functions; returns the mesh and those on it.
    """
    pairs, of_face = edges_of(mesh.faces)
    there = np.roll(level, -1, axis=1)
    crossing = (level > 0.0) != (there > 0.0)
    share = level / np.where(crossing, level - there, 1.0)
    share = np.where(mesh.faces == pairs[of_face, 0], share, 1.0 - share)
    # Where the two faces of an edge differ, their mean.
    edge = of_face[crossing]
    count = np.bincount(edge, minlength=len(pairs))
    mean = np.bincount(edge, share[crossing], len(pairs)) / np.maximum(count, 1)
    return divided(mesh, pairs, of_face, np.where(count > 0, mean, np.nan), values)


def divided(
    mesh: FineMesh, pairs: np.ndarray, of_face: np.ndarray, share: np.ndarray, values: np.ndarray
) -> tuple[FineMesh, np.ndarray]:
    """Faces divided at places on their edges, as `cut` has it.

    pairs (e, 2) and of_face (f, 3): the mesh's edges; share: (e,), of the way from the first vertex
    to the second, NaN for edges that stay whole. New vertices follow those of the mesh.
    """
    split = np.flatnonzero(np.isfinite(share))
    if not len(split):
        return mesh, values
    faces = mesh.faces
    number = np.full(len(pairs), -1)
    number[split] = len(mesh.vertices) + np.arange(len(split))
    share = np.clip(np.nan_to_num(share), _NO_NEEDLE, 1.0 - _NO_NEEDLE)
    one, two = mesh.vertices[pairs[split]].transpose(1, 0, 2)
    at = share[split, None]
    vertices = np.concatenate([mesh.vertices, (1.0 - at) * one + at * two])
    # Corners of the pieces: those of the face, then the places on its edges.
    hit = np.flatnonzero((number[of_face] >= 0).any(axis=1))
    middle = number[of_face[hit]]
    corners = np.arange(3 * len(hit)).reshape(-1, 3)
    names = np.concatenate([faces[hit].ravel(), middle.ravel()])
    made, source = split_edges(
        corners, np.where(middle >= 0, corners + 3 * len(hit), -1), vertices[names]
    )
    along = share[of_face[hit]]
    along = np.where(faces[hit] == pairs[of_face[hit], 0], along, 1.0 - along)[:, :, None]
    between = (1.0 - along) * values[hit] + along * np.roll(values[hit], -1, axis=1)
    at_corners = np.concatenate([values[hit], between])
    on_pieces = at_corners.reshape(6 * len(hit), values.shape[2])[made]
    rest = np.ones(len(faces), bool)
    rest[hit] = False
    fine = FineMesh(
        vertices,
        np.concatenate([faces[rest], names[made]]),
        np.concatenate([mesh.origin[rest], mesh.origin[hit[source]]]),
        mesh.edge_m,
    )
    return fine, np.concatenate([values[rest], on_pieces])


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
