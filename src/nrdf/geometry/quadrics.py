"""Quadrics fitted to points around a place: height, slope and curvature of a surface there."""

from __future__ import annotations

import numpy as np

_KEPT_SMALL = np.diag([1e-9, 1e-5, 1e-5, 3e-3, 3e-3, 3e-3])
"""Added to the normal equations: what the points do not fix stays near 0, curvature above all."""


def quadrics(offset: np.ndarray, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weighted least squares of 1, x, y, x²/2, xy, y²/2 around each of m places.

    Args:
        offset: (m, k, 2), x and y of the points around each place, from the place, of order 1.
        values: (m, k, c), what is fitted: heights of the points, or several things at once.
        weight: (m, k), not negative; of any size, as only their ratios count.

    Returns (m, 6, c), the coefficients: value, slopes and curvatures at the place itself. They are
    in units of `values`, for offsets in units of `offset`. Curvature that the points do not fix is
    kept small, and all is 0 where every weight is.
    """
    x, y = offset[..., 0], offset[..., 1]
    basis = np.stack([np.ones_like(x), x, y, x * x / 2.0, x * y, y * y / 2.0], axis=1)
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    weighted = basis * weight[:, None]
    normal = weighted @ basis.transpose(0, 2, 1)
    normal += _KEPT_SMALL.astype(normal.dtype)
    return np.linalg.solve(normal, weighted @ values)


def quadric_normals(coefficients: np.ndarray) -> np.ndarray:
    """Unit normals (m, 3) of height fields at the place itself, in the frame of x, y and height.

    coefficients: (m, 6), as of `quadrics`, heights in the unit of the offsets.
    """
    normals = np.concatenate(
        [-coefficients[:, 1:3], np.ones((len(coefficients), 1), coefficients.dtype)], axis=1
    )
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
