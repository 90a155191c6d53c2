"""Patches of a fine mesh: small pieces that look to one side, each with a face that stands for it.

What hardly changes from a triangle to the next, as what a tool feels or leaves there, is worked out
once a patch.
"""

from __future__ import annotations

import numpy as np

from nrdf.geometry.frames import SIDES
from nrdf.surface.fine_mesh import FineMesh


def patches_of(mesh: FineMesh, size_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The patches of a mesh: triangles whose centres are in one cube of that size, m, of a grid,
    and whose normals are nearest to one of the six sides.

    Returns the number (f,) of the patch that each triangle is of, from 0 on, and of each patch (p,)
    the triangle that is nearest to its centre.
    """
    cell = np.floor((mesh.centres - mesh.centres.min(axis=0)) / size_m).astype(np.int64)
    side = (mesh.normals @ SIDES.T).argmax(axis=1)
    count = cell.max(axis=0) + 1
    key = ((cell[:, 0] * count[1] + cell[:, 1]) * count[2] + cell[:, 2]) * len(SIDES) + side
    number = np.unique(key, return_inverse=True)[1].reshape(-1)
    total = np.maximum(np.bincount(number, mesh.areas), 1e-300)
    centre = np.stack(
        [np.bincount(number, mesh.areas * mesh.centres[:, a]) / total for a in range(3)], axis=1
    )
    away = ((mesh.centres - centre[number]) ** 2).sum(axis=1)
    order = np.lexsort([away, number])
    return number, order[np.unique(number[order], return_index=True)[1]]
