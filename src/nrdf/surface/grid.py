"""A regular grid over an unrolled patch."""

from __future__ import annotations

from dataclasses import dataclass

import contourpy
import numpy as np
from contourpy import LineType
from scipy import ndimage

MOST_CELLS = 500
"""Along a side: a grid is no finer than that."""


@dataclass(frozen=True)
class Grid:
    """Nodes at ``origin + pitch * (column, row)``; fields on it are (rows, columns)."""

    origin: np.ndarray
    pitch: float
    shape: tuple[int, int]

    @staticmethod
    def around(uv: np.ndarray, pitch: float, margin: float) -> Grid:
        """The grid that covers `uv` (n, 2) and `margin` around them, coarser than asked for where
        it would be very large."""
        low, high = uv.min(axis=0) - margin, uv.max(axis=0) + margin
        pitch = max(pitch, float((high - low).max()) / MOST_CELLS)
        columns, rows = np.ceil((high - low) / pitch).astype(int) + 1
        return Grid(low, pitch, (int(rows), int(columns)))

    @property
    def nodes(self) -> np.ndarray:
        """Places (rows, columns, 2) of the nodes."""
        rows, columns = self.shape
        u = self.origin[0] + self.pitch * np.arange(columns)
        v = self.origin[1] + self.pitch * np.arange(rows)
        return np.stack(np.meshgrid(u, v), axis=-1)

    def density(self, uv: np.ndarray, sigma: float, values: np.ndarray | None = None) -> np.ndarray:
        """Points `uv` (n, 2), weighed with `values` (n,), per area, blurred by `sigma` (m)."""
        column, row = np.rint((uv - self.origin) / self.pitch).astype(int).T
        rows, columns = self.shape
        count = np.bincount(row * columns + column, values, rows * columns).reshape(self.shape)
        return ndimage.gaussian_filter(count / self.pitch**2, sigma / self.pitch, mode="constant")

    def smooth(self, uv: np.ndarray, values: np.ndarray, sigma: float) -> np.ndarray:
        """`values` (n, k) at `uv` (n, 2) as smooth fields (k, rows, columns), extended beyond."""
        near, far = self.density(uv, sigma), self.density(uv, 5.0 * sigma)
        ground = 1e-6 * far.max()
        fields = [
            self.density(uv, sigma, column)
            + 1e-3 * self.density(uv, 5.0 * sigma, column)
            + ground * column.mean()
            for column in values.T
        ]
        return np.stack(fields) / (near + 1e-3 * far + ground)

    def sample(self, field: np.ndarray, uv: np.ndarray, order: int = 1) -> np.ndarray:
        """A field's values at `uv` (..., 2), linear between nodes, the nearest beyond the rim."""
        place = np.moveaxis((uv - self.origin) / self.pitch, -1, 0)[::-1]
        return ndimage.map_coordinates(field, place, order=order, mode="nearest")

    def contours(self, field: np.ndarray, level: float) -> list[np.ndarray]:
        """Lines (m, 2) on which a field has a value; closed ones end where they begin."""
        lines = contourpy.contour_generator(z=field, line_type=LineType.Separate).lines(level)
        return [self.origin + self.pitch * np.asarray(line) for line in lines]
