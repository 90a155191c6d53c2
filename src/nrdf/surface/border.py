"""Where a region ends, estimated from the points on either side of its border."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from nrdf.surface.grid import Grid

OWN, OTHER, CONTEXT = 0, 1, 2
"""Labels of a patch's points: its own; of another patch of the region; of no region."""
# All in spacings. Between points spread at random, no gap is wider than twice _CLOSED, and places
# farther than _EMPTY from all points join to areas above _HOLE in fewer than one region in twenty
# (of 2000 points).
_CLOSED, _EMPTY, _HOLE = 1.7, 0.9, 12.0
_RIM = 0.58  # how far the surface goes on beyond its last points
_VOTE, _BLUR = 0.8, 0.6  # blurs of the vote between labels, and of the outline


class Border:
    """The outline of one patch of a region, in its plane.

    uv: (n, 2), m; label: (n,), OWN, OTHER or CONTEXT; spacing: of the points, m. The region ends
    where others' points outnumber its own, and where the surface ends: at the points' outline,
    closed by a disc. Gaps are holes if they are larger than chance leaves between points. The
    border is known to about half the spacing.
    """

    def __init__(self, uv: np.ndarray, label: np.ndarray, spacing: float) -> None:
        self.grid = Grid.around(uv, spacing / 3.0, (_CLOSED + 1.0) * spacing)
        unit = spacing / self.grid.pitch
        surface = _surface(self.grid, uv, spacing)
        votes = [self.grid.density(uv[label == k], _VOTE * spacing) for k in (OWN, OTHER, CONTEXT)]
        own, other, context = votes
        vote = _balance(own + other, context) * unit
        region = ndimage.gaussian_filter(np.minimum(surface, vote), _BLUR * unit)
        stray = ndimage.binary_fill_holes(region > 0.0) & (region <= 0.0)
        region[stray & ~_large(stray, unit)] = 0.5
        self._distance = self._mine = _signed_distance(region, self.grid.pitch)
        if (label == OTHER).any():
            mine = _balance(own, other)
            self._mine = np.minimum(self._distance, _signed_distance(mine, self.grid.pitch))
            # Beyond the seam there is no border where merely the known points end.
            self._distance = _signed_distance(np.where(mine < 0.0, unit, region), self.grid.pitch)

    def distance(self, uv: np.ndarray) -> np.ndarray:
        """Distance of places uv (..., 2) from the region's border, m, (...); below 0 outside."""
        return self.grid.sample(self._distance, uv)

    def clearance(self, uv: np.ndarray, margin_m: float) -> np.ndarray:
        """How far places uv (..., 2) are inside what the patch has to work, m, (...).

        That is the region without `margin_m` along its border, up to the neighbouring patches.
        """
        return np.minimum(self.distance(uv) - margin_m, self.grid.sample(self._mine, uv))

    @property
    def deepest(self) -> float:
        """Distance of the innermost place from the border, m."""
        return float(self._distance.max())


def _surface(grid: Grid, uv: np.ndarray, spacing: float) -> np.ndarray:
    """How far inside the surface each node is, in cells, about; below 0 outside and in holes."""
    unit = spacing / grid.pitch
    away = _away(grid, uv)
    empty = away > _EMPTY * unit
    solid = ndimage.binary_fill_holes(away < _CLOSED * unit)
    closed = ndimage.distance_transform_edt(solid) - (_CLOSED - _RIM) * unit
    hole = ndimage.binary_dilation(_large(empty & (closed > 0.0), unit), iterations=int(unit))
    return np.where(hole, np.minimum(closed, _RIM * unit - away), closed)


def _away(grid: Grid, uv: np.ndarray) -> np.ndarray:
    """Distance of every node from the nearest of the points uv (n, 2), in cells."""
    place = (uv - grid.origin)[:, ::-1] / grid.pitch
    cell = tuple(np.rint(place).astype(int).T)
    nearest = np.zeros((*grid.shape, 2))
    nearest[cell] = place
    vacant = np.ones(grid.shape, bool)
    vacant[cell] = False
    row, column = ndimage.distance_transform_edt(
        vacant, return_distances=False, return_indices=True
    )
    return np.linalg.norm(nearest[row, column] - np.moveaxis(np.indices(grid.shape), 0, -1), axis=2)


def _signed_distance(field: np.ndarray, pitch: float) -> np.ndarray:
    """Distance (m) of every node from where a field passes 0; below 0 where the field is."""
    slope = np.hypot(*np.gradient(field))
    # How far a node next to the line is from it, in cells.
    short = np.clip(np.abs(field) / np.maximum(slope, 1e-12), 0.0, 1.0)
    distance = np.full(field.shape, np.inf)
    for side in (field > 0.0, field <= 0.0):
        if side.all():
            return np.where(side & (field > 0.0), np.inf, -np.inf)
        far, (row, column) = ndimage.distance_transform_edt(side, return_indices=True)
        distance[side] = (far - short[row, column])[side]
    return pitch * np.where(field > 0.0, distance, -distance)


def _large(mask: np.ndarray, unit: float) -> np.ndarray:
    """The mask without its connected parts that are too small for a hole."""
    part, count = ndimage.label(mask)
    large = np.bincount(part.ravel(), minlength=count + 1) > _HOLE * unit**2
    large[0] = False
    return large[part]


def _balance(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """From 1 where there is only `one` to -1 where there is only `other`; 1 where neither is."""
    total = one + other
    least = 1e-6 * total.max()
    return (one - other + least) / (total + least)
