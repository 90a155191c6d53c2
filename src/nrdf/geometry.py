"""Frames, thinning and oriented normals of point sets.

"Canonical" coordinates put the centre of the bounding box at the origin and make its longest side
1: ``canonical = (original - centre) / scale``. Canonical lengths carry no unit.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import CloudError

_LARGEST_GRID = 1 << 25  # cells of a dense voxel grid, 128 MiB of indices


def bounding_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner, each (3,), of `points` (n, 3), in their unit."""
    if len(points) == 0:
        raise CloudError("an empty point set has no bounding box; give at least one point")
    return points.min(axis=0), points.max(axis=0)


def canonical_transform(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (3,) and scale of `points` (n, 3): ``canonical = (points - centre) / scale``.

    The centre is the middle of the bounding box and the scale its longest side, both in the unit
    of `points`. Raises CloudError if there is no point or all points coincide.
    """
    lowest, highest = bounding_box(points)
    scale = float((highest - lowest).max())
    if not np.isfinite(scale) or scale <= 0.0:
        raise CloudError(
            f"the longest side of the points' bounding box is {scale}; a finite length above 0 is "
            "needed: all points coincide, or their coordinates are not finite"
        )
    return (lowest + highest) / 2.0, scale


def fibonacci_directions(count: int) -> np.ndarray:
    """`count` unit vectors (count, 3) spread evenly over the sphere (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    radius = np.sqrt(1.0 - z * z)
    angle = np.pi * (1.0 + 5.0**0.5) * index
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def thin(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (min(n, count),), ascending, of a subset that covers `points` (n, 3) evenly.

    One random point is kept in every cell of a voxel grid whose cell size is found by bisection,
    so that dense places give up more points than sparse ones. Ten million points take about two
    seconds. Points must be finite.
    """
    total = len(points)
    if total <= count:
        return np.arange(total)
    lowest, highest = bounding_box(points)
    side = max(float((highest - lowest).max()), np.finfo(np.float64).tiny)
    kept = np.arange(total)
    if total > 8 * count:
        # A first, fine grid makes the bisection independent of the number of points.
        fine = _one_per_cell(points, lowest, side / (6.0 * np.sqrt(count)))
        if len(fine) >= 2 * count:
            kept = fine
    kept = rng.permutation(kept)
    candidates = points[kept]
    small, large = side * 1e-4, side
    best = np.empty(0, dtype=np.int64)
    for _ in range(24):
        cell = float(np.sqrt(small * large))
        chosen = _one_per_cell(candidates, lowest, cell)
        if len(chosen) >= count:
            best, small = chosen, cell
            if len(chosen) <= 1.02 * count:
                break
        else:
            large = cell
    chosen = kept[best]
    if len(chosen) < count:  # many coincident points: fill up with whatever is left
        rest = np.setdiff1d(np.arange(total), chosen)
        chosen = np.concatenate([chosen, rng.choice(rest, count - len(chosen), replace=False)])
    return np.sort(rng.choice(chosen, count, replace=False))


def _one_per_cell(points: np.ndarray, lowest: np.ndarray, cell: float) -> np.ndarray:
    """Index of one point in each occupied cell of a grid, in the order of the cells."""
    shape = np.zeros(3, dtype=np.int64)
    key = np.zeros(len(points), dtype=np.int64)
    for axis in range(3):
        column = ((points[:, axis] - lowest[axis]) / cell).astype(np.int64)
        shape[axis] = int(column.max()) + 1
        key *= shape[axis]
        key += column
    if int(np.prod(shape)) <= _LARGEST_GRID:
        first = np.full(int(np.prod(shape)), -1, dtype=np.int32)
        first[key] = np.arange(len(points), dtype=np.int32)
        return first[first >= 0].astype(np.int64)
    return np.unique(key, return_index=True)[1]


def estimate_normals(points: np.ndarray, neighbours: int = 12, directions: int = 60) -> np.ndarray:
    """Outward unit normals (n, 3) of a full cloud `points` (n, 3), any unit.

    The line of each normal comes from a principal component analysis of the nearest `neighbours`;
    its sign from visibility: orthographic depth images of the cloud are taken from `directions`
    evenly spread viewpoints, and the normal points to where the point is seen from. Raises
    CloudError with fewer than 4 points.
    """
    points = np.asarray(points, dtype=np.float64)
    if len(points) < 4:
        raise CloudError(f"normals need at least 4 points, this cloud has {len(points)}")
    neighbours = min(neighbours, len(points))
    distance, index = cKDTree(points).query(points, neighbours, workers=-1)
    normals = _principal_normals(points, index)
    spacing = float(np.median(distance[:, -1])) * np.sqrt(np.pi / neighbours)
    return _orient(normals, points, fibonacci_directions(directions), spacing)[0]


def outward_by_visibility(
    points: np.ndarray, normals: np.ndarray, directions: int = 40
) -> tuple[np.ndarray, np.ndarray]:
    """Turn each of `normals` (n, 3) to the side that `points` (n, 3) are seen from.

    Returns the normals (n, 3), and for each point the number (n,) of the `directions` that see it
    from that side; points inside a hull are seen by few or none.
    """
    distance = cKDTree(points).query(points, min(9, len(points)), workers=-1)[0][:, -1]
    spacing = float(np.median(distance)) * np.sqrt(np.pi / 9.0)
    return _orient(normals, points, fibonacci_directions(directions), spacing)


def _orient(
    normals: np.ndarray, points: np.ndarray, views: np.ndarray, spacing: float
) -> tuple[np.ndarray, np.ndarray]:
    seen = visible_from(points, normals, views, spacing)
    facing = views @ normals.T
    flip = np.einsum("dn,dn->n", seen, facing) < 0.0
    count = (seen & ((facing > 0.0) != flip)).sum(axis=0)
    return np.where(flip[:, None], -normals, normals), count


def _principal_normals(points: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3), sign arbitrary, of the neighbourhoods `index` (n, k)."""
    offset = points[index]
    offset -= offset.mean(axis=1, keepdims=True)
    return np.linalg.eigh(offset.transpose(0, 2, 1) @ offset)[1][:, :, 0]


def visible_from(
    points: np.ndarray, normals: np.ndarray, views: np.ndarray, spacing: float
) -> np.ndarray:
    """Which of `points` (n, 3) each of the directions `views` (d, 3) sees: (d, n) bool.

    Orthographic depth images with cells of twice the point `spacing`. Depths are compared on the
    points' tangent planes (`normals` (n, 3), any sign) at the middle of the cell, so that a
    surface seen at a slant does not hide itself.
    """
    cell, tolerance, steepest = 2.0 * spacing, 0.7 * spacing, 3.0
    helper = np.where(np.abs(views[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    right = np.cross(views, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(views, right)
    seen = np.empty((len(views), len(points)), dtype=bool)
    for i, view in enumerate(views):
        x, y = points @ right[i] / cell, points @ up[i] / cell
        x, y = x - x.min(), y - y.min()
        column, row = x.astype(np.int64), y.astype(np.int64)
        toward = normals @ view
        toward = np.where(toward < 0, -1.0, 1.0) / np.maximum(np.abs(toward), 1.0 / steepest)
        slope_x, slope_y = -(normals @ right[i]) * toward, -(normals @ up[i]) * toward
        depth = points @ view + cell * (slope_x * (column + 0.5 - x) + slope_y * (row + 0.5 - y))
        pixel = row * (int(column.max()) + 1) + column
        nearest = np.full(int(pixel.max()) + 1, -np.inf)
        np.maximum.at(nearest, pixel, depth)
        seen[i] = depth >= nearest[pixel] - tolerance
    return seen
