"""Where a region ends, told from points that stand on either side of its border."""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from nrdf.process.grid import Grid

OWN, OTHER, CONTEXT = 0, 1, 2
"""Labels of a patch's points: its own; of another patch of the region; of no region."""
# All in spacings. Between points spread at random, no gap is wider than twice _CLOSED, and places
# farther than _EMPTY from all of them join to areas above _HOLE once in twenty objects of 2000.
_CLOSED, _EMPTY, _HOLE = 1.7, 0.9, 10.0
_RIM = 0.5  # how far the surface goes on beyond its last points
_VOTE, _BLUR = 0.8, 0.4  # blurs of the vote between labels, and of the outline


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
        self._region = ndimage.gaussian_filter(np.minimum(surface, vote), _BLUR * unit)
        self._mine = _balance(own, other)
        outline = _outline(self.grid, self._region)
        self._seam = None
        if (label == OTHER).any():
            outline = outline[self.grid.sample(self._mine, outline) > 0.0]
            seam = _outline(self.grid, self._mine)
            self._seam = _tree(seam[self.grid.sample(self._region, seam) > 0.0])
        self._outline = _tree(outline)

    def distance(self, uv: np.ndarray) -> np.ndarray:
        """Distance (m,) of places uv (m, 2) from the region's border, m; below 0 outside."""
        return self._signed(self._region, self._outline, uv)

    def clearance(self, uv: np.ndarray, margin_m: float) -> np.ndarray:
        """How far (m,) places uv (m, 2) are inside what the patch has to work, m.

        That is the region without `margin_m` along its border, up to the neighbouring patches.
        """
        inside = self.distance(uv) - margin_m
        if self._seam is None:
            return inside
        return np.minimum(inside, self._signed(self._mine, self._seam, uv))

    def _signed(self, field: np.ndarray, line: cKDTree | None, uv: np.ndarray) -> np.ndarray:
        flat = uv.reshape(-1, 2)
        sign = np.where(self.grid.sample(field, flat) > 0.0, 1.0, -1.0)
        far = np.full(len(flat), np.inf) if line is None else line.query(flat)[0]
        return (sign * far).reshape(uv.shape[:-1])


def _tree(points: np.ndarray) -> cKDTree | None:
    return cKDTree(points) if len(points) else None


def _surface(grid: Grid, uv: np.ndarray, spacing: float) -> np.ndarray:
    """How far inside the surface each node is, in cells, about; below 0 outside and in holes."""
    unit = spacing / grid.pitch
    away = cKDTree(uv).query(grid.nodes.reshape(-1, 2))[0].reshape(grid.shape) / grid.pitch
    empty = away > _EMPTY * unit
    solid = ndimage.binary_fill_holes(away < _CLOSED * unit)
    closed = ndimage.distance_transform_edt(solid) - (_CLOSED - _RIM) * unit
    hole = ndimage.binary_dilation(_large(empty & (closed > 0.0), unit), iterations=int(unit))
    return np.where(hole, np.minimum(closed, _RIM * unit - away), closed)


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


def _outline(grid: Grid, field: np.ndarray) -> np.ndarray:
    """Points (m, 2), a third of the grid's pitch apart, of the lines on which the field is 0."""
    # A contour has a point on every edge of the grid that it crosses.
    shares = np.arange(3)[:, None, None] / 3.0
    lines = grid.contours(field, 0.0)
    fine = [(line[:-1] + shares * np.diff(line, axis=0)).reshape(-1, 2) for line in lines]
    return np.concatenate([np.empty((0, 2)), *fine])
