"""Order: which path comes next, and from which end, so that the ways between are short."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.toolpath.surface_path import SurfacePath


def order_nearest(paths: Sequence[SurfacePath], one_way: bool = False) -> list[SurfacePath]:
    """The same paths in a shorter order: from each one's end to the nearest end of another.

    Paths may be driven backwards, unless `one_way`. The first one stays first. An order that is
    not shorter than the one that was given is not taken.
    """
    if len(paths) < 3:
        return list(paths)
    ends = np.array([[path.contacts[0], path.contacts[-1]] for path in paths])
    waiting = np.ones(len(paths), bool)
    ordered, place, which, backwards = [paths[0]], ends[0, 1], 0, False
    for _ in range(len(paths) - 1):
        waiting[which] = False
        left = np.flatnonzero(waiting)
        away = np.linalg.norm(ends[left] - place, axis=2)
        if one_way:
            away[:, 1] = np.inf
        k, end = np.unravel_index(int(np.argmin(away)), away.shape)
        which, backwards = int(left[k]), bool(end)
        ordered.append(paths[which].reversed() if backwards else paths[which])
        place = ends[which, 0 if backwards else 1]
    return ordered if way_between(ordered) < way_between(paths) else list(paths)


def way_between(paths: Sequence[SurfacePath]) -> float:
    """The straight ways from each path's end to the next one's start, m."""
    starts = np.array([path.contacts[0] for path in paths[1:]]).reshape(-1, 3)
    stops = np.array([path.contacts[-1] for path in paths[:-1]]).reshape(-1, 3)
    return float(np.linalg.norm(starts - stops, axis=1).sum())
