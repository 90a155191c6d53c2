"""Fewer points of a cloud, spread evenly; directions and places on triangles, spread evenly."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.canonical import bounding_box

_LARGEST_GRID = 1 << 25  # cells of a dense voxel grid, 128 MiB of indices
_CHUNK = 1 << 18  # points handled at a time
_SAME_PLACE = 1e-7  # in shares of the longest side: points nearer than that are in one place

_GOLDEN = np.array([0.7548776662466927, 0.5698402909980532])  # of the plane (Roberts, 2018)


def downsample(points: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Indices (min(n, count),), ascending, of a subset that covers `points` (n, 3) evenly.

    One random point is kept in every cell of a voxel grid whose cell size is found by bisection,
    so that dense places give up more points than sparse ones. Ten million points take about two
    seconds. Points must be finite.
    """
    total = len(points)
    if total <= count:
        return np.arange(total)
    lowest, highest = bounding_box(points)
    side = float((highest - lowest).max())
    if side == 0.0:
        return np.sort(rng.choice(total, count, replace=False))
    kept: np.ndarray = np.arange(total)
    if total > 8 * count:
        # A first, fine grid makes the bisection independent of the number of points.
        fine = one_per_cell(points, lowest, side / min(6.0 * np.sqrt(count), 320.0))
        few = len(fine) < 2 * count
        kept = np.unique(rng.integers(0, total, 8 * count)) if few else fine
        if len(kept) > 64 * count:
            kept = kept[np.unique(rng.integers(0, len(kept), 64 * count))]
    kept = rng.permutation(kept)
    candidates = points[kept]
    small, large = 1e-4, 1.0
    best = np.empty(0, dtype=np.int64)
    for _ in range(24):
        cell = float(np.sqrt(small * large))
        chosen = one_per_cell(candidates, lowest, cell * side)
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


def distinct_points(points: np.ndarray, normals: np.ndarray | None = None) -> np.ndarray:
    """Indices (k,), ascending, of points (n, 3) without those in the place of another one.

    With normals (n, 3), one point stays for each of the two sides that coincident ones face.
    """
    low = points.min(axis=0)
    side = max(float((points.max(axis=0) - low).max()), np.finfo(float).tiny)
    place = np.round((points - low) / (_SAME_PLACE * side)).astype(np.int64)
    _, first, group = np.unique(place, axis=0, return_index=True, return_inverse=True)
    if len(first) == len(points):
        return np.arange(len(points))
    if normals is None:
        return np.sort(first)
    away = np.einsum("na,na->n", normals, normals[first[group.ravel()]]) < 0
    opposite = np.flatnonzero(away)
    _, once = np.unique(group.ravel()[opposite], return_index=True)
    return np.sort(np.concatenate([first, opposite[once]]))


def indices_in_subset(subset: np.ndarray, indices: np.ndarray, count: int) -> np.ndarray:
    """Some of a cloud's `count` points, by their `indices` (m,), as positions in a subset of it.

    subset: (k,) indices into the cloud. Returns positions in `subset`, ascending; points that are
    not in it are left out.
    """
    chosen = np.zeros(count, bool)
    chosen[indices] = True
    return np.flatnonzero(chosen[subset])


def one_per_cell(points: np.ndarray, lowest: np.ndarray, cell: float) -> np.ndarray:
    """Index of one point in each occupied cell of a grid, in the order of the cells."""
    shape = ((points.max(axis=0) - lowest) / cell).astype(np.int64) + 1
    strides = np.array([shape[1] * shape[2], shape[2], 1], dtype=np.float64)
    dense = float(np.prod(shape.astype(float))) <= _LARGEST_GRID
    first = np.full(int(np.prod(shape)) if dense else 0, -1, dtype=np.int32)
    keys = np.empty(0 if dense else len(points), dtype=np.int64)
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK]
        key = (np.floor((chunk - lowest) / cell) @ strides).astype(np.int64)
        if dense:
            first[key] = np.arange(start, start + len(chunk), dtype=np.int32)
        else:
            keys[start : start + len(chunk)] = key
    return first[first >= 0].astype(np.int64) if dense else np.unique(keys, return_index=True)[1]


def fibonacci_directions(count: int) -> np.ndarray:
    """`count` unit vectors (count, 3) spread evenly over the sphere (Fibonacci lattice)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    radius = np.sqrt(1.0 - z * z)
    angle = np.pi * (1.0 + 5.0**0.5) * index
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def spread_in_triangles(corners: np.ndarray) -> np.ndarray:
    """A place (n, 3) in each of triangles (n, 3, 3); those in the same one lie evenly in it."""
    one, other = (np.outer(np.arange(1, len(corners) + 1), _GOLDEN) % 1.0).T[..., None]
    folded = one + other > 1.0  # at the diagonal of the parallelogram
    one, other = np.where(folded, 1.0 - one, one), np.where(folded, 1.0 - other, other)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    return np.asarray(a + one * (b - a) + other * (c - a))
