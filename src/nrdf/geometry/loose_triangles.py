"""Whether triangles hang together as a surface: told before anything is done with them.

What is done with a mesh takes time and memory for each of its pieces. A million triangles that
touch no other are no object, and would end nothing but the memory.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.errors import DataError
from nrdf.geometry.mesh import row_keys, triangle_areas

SAME_PLACE = 2e-6
"""Longest sides within which vertices of triangles that do not touch are one."""
_FEW = 4  # faces of a piece that is no surface by itself
_LOOSE, _MANY_LOOSE = 0.5, 2_000  # share and number of faces in such pieces: no surface
_MOST_MET = 100.0  # faces that a line through a surface meets, on average


def check_surface(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Raise DataError for triangles that are no surface, of vertices (v, 3), finite, faces (f, 3).

    These are more than 2000 faces, and more than half of all, in pieces of at most four, where
    nearly equal vertices are one; and so many faces that a line through them meets 100 of them.
    """
    most = max(_LOOSE * len(faces), _MANY_LOOSE)
    loose = count_loose(faces)
    if loose > most:
        loose = count_loose(_nearly_welded(vertices, faces))
    if loose > most:
        raise DataError(
            f"{loose} of its {len(faces)} triangles are loose, they touch three others at most: "
            "that is no surface; merge its vertices, or give its points as a cloud"
        )
    met = _met_by_lines(vertices, faces)
    if met > _MOST_MET:
        raise DataError(
            f"a straight line through it meets {met:.0f} of its {len(faces)} triangles on average: "
            "that is no surface; check its faces, or give its points as a cloud"
        )


def count_loose(faces: np.ndarray, few: int = _FEW) -> int:
    """How many faces (f, 3) belong to pieces of at most `few` that share vertices."""
    used = np.bincount(faces.reshape(-1))
    around = used[faces].max(axis=1, initial=0)
    # Mostly that tells: faces around a vertex that many have are in no such piece.
    if few == 1 or not (around <= few).any():
        return int((around <= few).sum())
    count = len(faces)
    links = (np.repeat(np.arange(count), 3), count + faces.reshape(-1))
    graph = coo_matrix((np.ones(faces.size, bool), links), (count + len(used),) * 2)
    piece = connected_components(graph, directed=False)[1][:count]
    size = np.bincount(piece)
    return int(size[size <= few].sum())


def _nearly_welded(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The faces, where vertices in one cell of a fine grid are one: most of those that are nearly
    equal, in a fraction of the time of a search."""
    low, extent = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    cell = np.floor((vertices - low) / max(SAME_PLACE * extent, 1e-300))
    return np.asarray(np.unique(row_keys(cell), return_inverse=True)[1].reshape(-1)[faces])


def _met_by_lines(vertices: np.ndarray, faces: np.ndarray) -> float:
    """How many faces a line meets that meets the mesh's box, on average (Crofton's formula)."""
    area = float(triangle_areas(vertices, faces).sum())
    x, y, z = np.ptp(vertices, axis=0)
    return area / max(float(x * y + y * z + z * x), 1e-300)
