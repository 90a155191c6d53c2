"""Meshes for a screen, not to plan or to measure on: fewer triangles, edges that look sharp."""

from __future__ import annotations

import igl
import numpy as np

from nrdf.geometry.mesh import triangle_areas

_SHARP_DEG = 35.0
_LARGER = 1.2  # factor by which cells grow until few enough triangles are left


def simplified(vertices: np.ndarray, faces: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """A mesh (v, 3), (f, 3) with at most `most` triangles; as it is where it has no more.

    Vertices in one cell of a grid become the one nearest their mean (Rossignac and Borrel, 1993);
    triangles within a cell go. No vertex moves by more than a cell's diagonal.
    """
    if len(faces) <= most:
        return vertices, faces
    area = float(triangle_areas(vertices, faces).sum())
    cell = float(np.sqrt(2.0 * area / most))
    while True:
        kept, left = _clustered(vertices, faces, cell)
        if len(left) <= most:
            return kept, left
        cell *= _LARGER


def _clustered(
    vertices: np.ndarray, faces: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray]:
    where = np.floor((vertices - vertices.min(axis=0)) / max(cell, 1e-300)).astype(np.int64)
    _, group = np.unique(where, axis=0, return_inverse=True)
    group = group.reshape(-1)
    count = np.bincount(group)
    mean = np.stack([np.bincount(group, vertices[:, k]) / count for k in range(3)], axis=1)
    away = np.linalg.norm(vertices - mean[group], axis=1)
    order = np.lexsort((away, group))
    first = order[np.concatenate([[0], np.cumsum(count)[:-1]])]
    faces = group[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return vertices[first], faces[np.sort(once)]


def split_at_edges(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh (v, 3), (f, 3) whose vertices are apart where it turns by more than 35 degrees.

    What draws it with one normal for each vertex then shows bends smooth and edges sharp.
    """
    corners = np.nan_to_num(igl.per_corner_normals(vertices, faces, _SHARP_DEG))
    key = np.column_stack([faces.reshape(-1), np.rint(1e4 * corners).astype(np.int64)])
    _, first, number = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return vertices[faces.reshape(-1)[first]], number.reshape(-1, 3)
