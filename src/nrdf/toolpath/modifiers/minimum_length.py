"""Minimum length: short paths go, unless they alone reach a part of the region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from nrdf.toolpath.surface_path import SurfacePath

_ALIKE = 0.5  # cosine between the normals of a point and of a path on its side


def minimum_length(
    paths: Sequence[SurfacePath],
    least_m: float,
    points: np.ndarray,
    normals: np.ndarray,
    radius_m: float,
    needed: float = 0.0,
    lost: float = np.inf,
    droppable: np.ndarray | None = None,
) -> list[SurfacePath]:
    """Paths less those shorter than `least_m` that nothing is lost with.

    points, normals: (n, 3), spread over the region, which tell what the footprint of `radius_m`
    reaches. A short path stays if it alone reaches more than the share `needed` of them, or if more
    than the share `lost` would go with all that go. The shortest are looked at first. droppable:
    which of the paths (k,) may go; all, unless given.
    """
    lengths = np.array([path.length_m for path in paths])
    may_go = lengths < least_m if droppable is None else (lengths < least_m) & droppable
    short = [int(k) for k in np.argsort(lengths, kind="stable") if may_go[k]]
    if not short:
        return list(paths)
    reached = [_reached(path, points, normals, radius_m) for path in paths]
    count = np.bincount(np.concatenate(reached), minlength=len(points))
    dropped: set[int] = set()
    left = lost * len(points)
    for k in short:
        alone = int((count[reached[k]] == 1).sum())
        if alone <= min(needed * len(points), left) and len(dropped) < len(paths) - 1:
            left -= alone
            count[reached[k]] -= 1
            dropped.add(k)
    return [path for k, path in enumerate(paths) if k not in dropped]


def _reached(
    path: SurfacePath, points: np.ndarray, normals: np.ndarray, radius_m: float
) -> np.ndarray:
    """Which points (k,) the footprint of a path passes over."""
    low, high = path.contacts.min(axis=0) - radius_m, path.contacts.max(axis=0) + radius_m
    there = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    away, near = cKDTree(path.contacts).query(points[there], distance_upper_bound=radius_m)
    reached = np.isfinite(away)
    there, near = there[reached], near[reached]
    alike = np.einsum("na,na->n", path.normals[near], normals[there]) > _ALIKE
    return np.asarray(there[alike])
