"""The smooth surface that a point cloud stands for."""

from __future__ import annotations

import numpy as np


class Surface:
    """An object's cloud with outward normals, as a surface to work on.

    points: (n, 3), m; normals: (n, 3) unit, outward.
    """

    def __init__(self, points_m: np.ndarray, normals: np.ndarray) -> None:
        self.points = np.ascontiguousarray(points_m, dtype=np.float64)
        self.normals = np.ascontiguousarray(normals, dtype=np.float64)
