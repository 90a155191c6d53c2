"""Patches of a fine mesh: small pieces that look to one side, each with a face that stands for it.

What hardly changes from a triangle to the next, as what a tool feels or leaves there, is worked out
once a patch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.geometry.frames import SIDES
from nrdf.surface.fine_mesh import FineMesh


@dataclass(frozen=True)
class Patches:
    """number: (f,) the patch that each triangle of a mesh is of, from 0 on. nearest: (p,) of each
    patch the triangle that is nearest to its centre."""

    number: np.ndarray
    nearest: np.ndarray

    @staticmethod
    def of(mesh: FineMesh, size_m: float) -> Patches:
        """Triangles whose centres are in one cube of that size, m, of a grid, and whose normals are
        nearest to one of the six sides, are a patch."""
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
        return Patches(number, order[np.unique(number[order], return_index=True)[1]])

    def to_triangles(self, values: np.ndarray) -> np.ndarray:
        """Values (p, ...) of patches as those of their triangles (f, ...)."""
        return values[self.number]
