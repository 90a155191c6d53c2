"""Triangle meshes cut along a curve: where a function of their corners is zero."""

from __future__ import annotations

import numpy as np

from nrdf.surface.fine_mesh import FineMesh, edges_of, split_edges

_NO_NEEDLE = 0.02  # share of an edge that a cut leaves at least on either side


def cut(mesh: FineMesh, level: np.ndarray, values: np.ndarray) -> tuple[FineMesh, np.ndarray]:
    """Faces divided where a function `level` (f, 3) of their corners changes its sign.

    The function may differ between the faces around a vertex. Faces that share an edge still share
    it afterwards. values: (f, 3, k), other functions; returns the mesh and those on it.
    """
    faces = mesh.faces
    pairs, of_face = edges_of(faces)
    here, there = level, np.roll(level, -1, axis=1)
    crossing = (here > 0.0) != (there > 0.0)
    if not crossing.any():
        return mesh, values
    # Shares from the edge's first vertex on; where its two faces differ, their mean.
    share = here / np.where(crossing, here - there, 1.0)
    backwards = faces != pairs[of_face, 0]
    share = np.clip(np.where(backwards, 1.0 - share, share), _NO_NEEDLE, 1.0 - _NO_NEEDLE)
    edge = of_face[crossing]
    count = np.bincount(edge, minlength=len(pairs))
    mean = np.bincount(edge, share[crossing], len(pairs)) / np.maximum(count, 1)
    cut_edges = np.flatnonzero(count)
    number = np.full(len(pairs), -1)
    number[cut_edges] = len(mesh.vertices) + np.arange(len(cut_edges))
    at = mean[cut_edges, None]
    one, two = mesh.vertices[pairs[cut_edges]].transpose(1, 0, 2)
    vertices = np.concatenate([mesh.vertices, (1.0 - at) * one + at * two])
    # Corners of the pieces: those of the face, then the places on its edges.
    hit = np.flatnonzero((number[of_face] >= 0).any(axis=1))
    middle = number[of_face[hit]]
    corners = np.arange(3 * len(hit)).reshape(-1, 3)
    names = np.concatenate([faces[hit].ravel(), middle.ravel()])
    made, source = split_edges(
        corners, np.where(middle >= 0, corners + 3 * len(hit), -1), vertices[names]
    )
    along = mean[of_face[hit]][:, :, None]
    along = np.where(backwards[hit][:, :, None], 1.0 - along, along)
    between = (1.0 - along) * values[hit] + along * np.roll(values[hit], -1, axis=1)
    all_values = np.concatenate([values[hit], between]).reshape(-1, values.shape[2])
    rest = np.ones(len(faces), bool)
    rest[hit] = False
    fine = FineMesh(
        vertices,
        np.concatenate([faces[rest], names[made]]),
        np.concatenate([mesh.origin[rest], mesh.origin[hit[source]]]),
        mesh.edge_m,
    )
    return fine, np.concatenate([values[rest], all_values[made]])
