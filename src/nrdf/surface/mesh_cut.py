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
    there = np.roll(level, -1, axis=1)
    crossing = (level > 0.0) != (there > 0.0)
    # Only those faces, and their neighbours, have a place on an edge.
    ends = np.zeros(len(mesh.vertices), bool)
    ends[mesh.faces[crossing]] = True
    ends[np.roll(mesh.faces, -1, axis=1)[crossing]] = True
    near = ends[mesh.faces].sum(axis=1) > 1
    faces, level, there, crossing = mesh.faces[near], level[near], there[near], crossing[near]
    pairs, of_face = edges_of(faces)
    share = level / np.where(crossing, level - there, 1.0)
    share = np.where(faces == pairs[of_face, 0], share, 1.0 - share)
    # Where the two faces of an edge differ, their mean.
    edge = of_face[crossing]
    count = np.bincount(edge, minlength=len(pairs))
    mean = np.bincount(edge, share[crossing], len(pairs)) / np.maximum(count, 1)
    share = np.where(count > 0, mean, np.nan)
    part = FineMesh(mesh.vertices, faces, mesh.origin[near], mesh.edge_m)
    pieces, on_pieces = divided(part, pairs, of_face, share, values[near])
    if pieces is part:
        return mesh, values
    whole = FineMesh(
        pieces.vertices,
        np.concatenate([mesh.faces[~near], pieces.faces]),
        np.concatenate([mesh.origin[~near], pieces.origin]),
        mesh.edge_m,
    )
    return whole, np.concatenate([values[~near], on_pieces])


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
