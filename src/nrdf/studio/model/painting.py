"""Painting on a point cloud: patches along the surface, strokes, borders, holes, mirror images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from nrdf.geometry.canonical import MIRROR
from nrdf.surface.surface import Surface

_NORMAL_WEIGHT = 6.0
"""How many spacings apart two places count whose normals are at right angles."""
_ZIGZAG = 1.2
"""How much longer than a straight line the way over points is on a flat surface, at most."""
_MIRRORED = 4.0  # spacings within which a mirror image must have its counterpart
_SMOOTHED = 2.5  # spacings over which a border is smoothed
_LARGEST_HOLE = 0.25  # of the region around it


class Canvas:
    """A surface that regions are painted on, as masks (n,) of its points.

    Ways lead along the surface's own edges (`Surface.edges`), which never go through a thin part
    or over a sharp border: a patch on the front of a backrest stays there.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        count = len(surface.points)
        i, j = surface.edges.T
        length = np.linalg.norm(surface.points[i] - surface.points[j], axis=1)
        self._ways = csr_matrix((length, (i, j)), shape=(count, count))

    def distances(self, seeds: int | Sequence[int] | np.ndarray, limit: float) -> np.ndarray:
        """Distance (n,), m, along the surface to the nearest of some points; infinite past the
        limit, and where no way leads.

        Ways from point to point zigzag: where one is hardly longer than the straight line, on what
        is nearly flat, the straight line counts.
        """
        points = self.surface.points
        way, _, source = dijkstra(
            self._ways,
            directed=False,
            indices=np.unique(seeds),
            limit=_ZIGZAG * limit,
            min_only=True,
            return_predecessors=True,
        )
        met = np.flatnonzero(np.isfinite(way))
        straight = np.linalg.norm(points[met] - points[source[met]], axis=1)
        way[met] = np.where(way[met] <= _ZIGZAG * straight, straight, way[met])
        return np.where(way <= limit, way, np.inf)

    def patch(self, seeds: int | Sequence[int], radius: float) -> np.ndarray:
        """The points (n,) bool within a radius, m, of one or more points along the surface."""
        return self.distances(seeds, radius) <= radius

    def offset(self, mask: np.ndarray, by_m: float) -> np.ndarray:
        """A region (n,) bool whose border is moved outward by a distance, m, or inward below 0.

        The border lies halfway between the points on its two sides.
        """
        half, side = 0.5 * self.surface.spacing, mask if by_m > 0 else ~mask
        if not side.any() or side.all():
            return mask
        passed = self.distances(np.flatnonzero(side), abs(by_m) + half) <= abs(by_m) + half
        return passed if by_m > 0 else ~passed

    def filled(self, mask: np.ndarray) -> np.ndarray:
        """A region (n,) bool without its holes: what it encloses and is much smaller than it."""
        out = np.flatnonzero(~mask)
        if not len(out) or not mask.any():
            return mask
        part = connected_components(self._ways[out][:, out], directed=False)[1]
        i, j = self.surface.edges.T
        beside = np.zeros(len(mask), bool)
        beside[i[mask[j]]], beside[j[mask[i]]] = True, True
        size = np.bincount(part)
        enclosed = np.zeros(len(size), bool)
        enclosed[part[beside[out]]] = True
        enclosed &= size < min(_LARGEST_HOLE * mask.sum(), size.max())
        filled = mask.copy()
        filled[out[enclosed[part]]] = True
        return filled

    def smoothed(self, mask: np.ndarray) -> np.ndarray:
        """A region (n,) bool with a smooth border: each point as the most around it are."""
        ones = csr_matrix((np.ones(self._ways.nnz), self._ways.nonzero()), self._ways.shape)
        ones = ones + ones.T
        share, weight = mask.astype(float), np.maximum(ones @ np.ones(len(mask)), 1.0)
        for _ in range(round(_SMOOTHED)):
            share = (share + ones @ share / weight) / 2
        return np.where(weight > 1.0, share > 0.5, mask)

    def mirrored(self, mask: np.ndarray) -> np.ndarray:
        """Where a region (n,) bool lies on the other side of an object, left for right.

        The plane is that of the category's canonical frame: z through the middle of the bounding
        box. A point is in it whose mirror image has a counterpart, in place and normal, in the
        region.
        """
        surface = self.surface
        middle = (surface.points.min(axis=0) + surface.points.max(axis=0)) / 2
        here = (surface.points - middle) / surface.spacing
        turned = _NORMAL_WEIGHT * surface.normals
        tree = cKDTree(np.hstack([here, turned]))
        there = np.hstack([here * MIRROR, turned * MIRROR])
        away, which = tree.query(there, distance_upper_bound=_MIRRORED)
        found = np.isfinite(away)
        return found & np.append(mask, False)[which]
