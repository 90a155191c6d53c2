"""The smooth surface that a point cloud stands for."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry import thin

if TYPE_CHECKING:
    from nrdf.process.patch import Patch

MOST_POINTS = 30_000
"""A larger cloud is thinned evenly: finer points than a tool can follow only cost time."""
SAME_SIDE = 0.5
"""Least cosine between the normals of points that may belong to one sheet."""
_NEIGHBOURS = 10
_FITTED = 20


class Surface:
    """An object's cloud with outward normals, as a surface to work on.

    points: (n, 3), m; normals: (n, 3), brought to unit length, outward. The two sides of a thin
    part are told apart by their normals alone. Raises ProcessError if the two do not fit each
    other, are not finite, or are fewer than 8.
    """

    def __init__(self, points_m: np.ndarray, normals: np.ndarray) -> None:
        points = np.ascontiguousarray(points_m, dtype=np.float64)
        normals = np.array(normals, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or normals.shape != points.shape:
            raise ProcessError(
                f"points {points.shape} and normals {normals.shape} must both be (n, 3)"
            )
        if len(points) < 8 or not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise ProcessError(
                f"a surface needs at least 8 finite points with normals, not {len(points)}"
            )
        self.size = len(points)
        self._kept = thin(points, MOST_POINTS, np.random.default_rng(0))
        self.points = points[self._kept]
        self.normals = unit(normals[self._kept])
        self.patches: dict[bytes, tuple[Patch, ...]] = {}

    def indices(self, region: np.ndarray) -> np.ndarray:
        """Indices (k,), ascending, of `points` for a region (indices into the cloud as given).

        Raises ProcessError if it is empty or does not fit the cloud.
        """
        region = np.unique(np.asarray(region))
        if region.size == 0 or not np.issubdtype(region.dtype, np.integer):
            raise ProcessError("a region must be the indices of one or more of the cloud's points")
        if region[0] < 0 or region[-1] >= self.size:
            raise ProcessError(
                f"a region has indices {region[0]} to {region[-1]}; the cloud's are 0 to "
                f"{self.size - 1}"
            )
        mask = np.zeros(self.size, bool)
        mask[region] = True
        return np.flatnonzero(mask[self._kept])

    @cached_property
    def tree(self) -> cKDTree:
        return cKDTree(self.points)

    @cached_property
    def _nearest(self) -> tuple[np.ndarray, np.ndarray]:
        return self.tree.query(self.points, min(_NEIGHBOURS + 1, len(self.points)))

    @cached_property
    def spacing(self) -> float:
        """Typical distance between points, m: the side of the square that each has to itself."""
        distance = self._nearest[0][:, -1]
        return float(np.median(distance) * np.sqrt(np.pi / self._nearest[0].shape[1]))

    @cached_property
    def edges(self) -> np.ndarray:
        """Neighbours (e, 2) on one sheet, each pair once, the lower index first.

        Pairs that lean out of each other's tangent plane, or whose normals differ much, are left
        out, so that no edge leads through a thin part.
        """
        distance, near = self._nearest
        i = np.repeat(np.arange(len(near)), near.shape[1] - 1)
        j, length = near[:, 1:].ravel(), distance[:, 1:].ravel()
        along = self.points[j] - self.points[i]
        rise = np.maximum(
            np.abs(np.einsum("ea,ea->e", along, self.normals[i])),
            np.abs(np.einsum("ea,ea->e", along, self.normals[j])),
        )
        alike = np.einsum("ea,ea->e", self.normals[i], self.normals[j]) > SAME_SIDE
        good = alike & (rise <= 0.6 * length) & (length < 3.0 * self.spacing) & (i != j)
        pair = np.sort(np.stack([i[good], j[good]], axis=1), axis=1)
        return np.unique(pair, axis=0)

    def project(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest places on the smooth surface, and its normals there, each (m, 3).

        points: (m, 3), m, near the surface; normals: (m, 3), roughly outward, tell the side.
        Moving least squares: a quadric over the tangent plane, fitted to the nearest points of the
        side (Alexa et al., 2003). A point with no surface of its side around stays where it is.
        """
        points, normals = np.array(points, dtype=np.float64), unit(normals)
        for _ in range(2):
            near, weight = self._same_side(points, normals, 2 * _FITTED, 3.0 * self.spacing)
            enough = (weight > 0).sum(axis=1) >= 6
            mean = np.einsum("mk,mka->ma", weight, self.normals[near])
            normals = np.where(enough[:, None], unit(mean), normals)
            frame = tangent_frames(normals)
            offset = np.einsum("mkb,mab->mka", self.points[near] - points[:, None], frame)
            scale = self.spacing
            found = quadrics(offset[..., :2] / scale, offset[..., 2:], weight)
            height, slope = found[:, 0, 0], found[:, 1:3, 0] / scale
            points = points + np.where(enough, height, 0.0)[:, None] * normals
            tilted = normals - np.einsum("ma,mab->mb", slope, frame[:, :2])
            normals = np.where(enough[:, None], unit(tilted), normals)
        return points, normals

    def smooth_normals(
        self, points: np.ndarray, normals: np.ndarray, radius_m: float
    ) -> np.ndarray:
        """Outward normals (m, 3), averaged over the sheet within `radius_m` of points (m, 3).

        normals: (m, 3), roughly outward, tell the side. What a flat tool of that radius feels.
        """
        radius = max(radius_m, 2.0 * self.spacing)
        count = int(np.clip(2.0 * np.pi * (radius / self.spacing) ** 2, 16, 256))
        near, weight = self._same_side(points, unit(normals), count, radius)
        mean = np.einsum("mk,mka->ma", weight, self.normals[near])
        found = np.asarray(weight.any(axis=1))[:, None]
        return np.where(found, unit(mean), unit(normals))

    def _same_side(
        self, points: np.ndarray, normals: np.ndarray, count: int, radius: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Indices and weights (m, k) of the points around, 0 for those of another sheet."""
        distance, near = self.tree.query(points, min(count, len(self.points)))
        facing = np.einsum("mka,ma->mk", self.normals[near], normals)
        rise = np.einsum("mka,ma->mk", self.points[near] - points[:, None], normals)
        good = (facing > SAME_SIDE) & (np.abs(rise) < 0.6 * distance + self.spacing)
        weight = np.maximum(1.0 - (distance / radius) ** 2, 0.0) ** 2 * facing * good
        return near, weight


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) brought to unit length; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors) / np.maximum(length, 1e-12)


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """Right-handed frames (m, 3, 3) at unit normals (m, 3): rows are two tangents, the normal."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = unit(np.cross(normals, helper))
    return np.stack([first, np.cross(normals, first), normals], axis=1)


def quadrics(offset: np.ndarray, values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weighted least squares of 1, x, y, x²/2, xy, y²/2: coefficients (m, 6, c).

    offset: (m, k, 2), of order 1; values: (m, k, c); weight: (m, k). Curvature that the points do
    not fix is kept small.
    """
    x, y = offset[..., 0], offset[..., 1]
    basis = np.stack([np.ones_like(x), x, y, x * x / 2.0, x * y, y * y / 2.0], axis=-1)
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    weighted = basis * weight[..., None]
    normal = np.einsum("mki,mkj->mij", weighted, basis)
    normal += np.diag([1e-9, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3])
    return np.linalg.solve(normal, np.einsum("mki,mkc->mic", weighted, values))
