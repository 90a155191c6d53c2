"""Run-off: paths go on beyond their ends, as the surface bends there, and rise from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length
from nrdf.toolpath.surface_path import SurfacePath

Free = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""At which of points (n, 3), driven in directions (n, 3), with normals (n, 3), a tool may be."""
_WINDOW = 4  # steps of a path's end, at least, that tell how it bends
_MOST_BEND_RAD = float(np.radians(30.0))


def run_off(
    paths: Sequence[SurfacePath],
    length_m: float,
    spacing_m: float,
    height_m: float = 0.0,
    free: Free | None = None,
) -> list[SurfacePath]:
    """Paths that go on by `length_m` beyond either end, `height_m` over the surface at last.

    They keep the direction and the bend along the normal of their last `length_m`, and rise without
    a kink. `free` tells where a tool may go: the run-off ends before the first point that is not.
    Closed paths have no ends. A length of 0 changes nothing.
    """
    if length_m <= 0.0:
        return list(paths)
    longer = []
    for path in paths:
        if path.closed or len(path.contacts) < 2:
            longer.append(path)
            continue
        tail = _beyond(path, length_m, spacing_m, height_m, free)
        head = _beyond(path.reversed(), length_m, spacing_m, height_m, free).reversed()
        longer.append(
            replace(
                path,
                contacts=np.concatenate([head.contacts, path.contacts, tail.contacts]),
                normals=np.concatenate([head.normals, path.normals, tail.normals]),
            )
        )
    return longer


def _beyond(
    path: SurfacePath, length_m: float, spacing_m: float, height_m: float, free: Free | None
) -> SurfacePath:
    """The points after a path's end."""
    normal = path.normals[-1]
    travel, bend = _end_of(path, length_m)
    count = max(int(np.ceil(length_m / spacing_m - 1e-9)), 1)
    along = length_m * (np.arange(count) + 1.0)[:, None] / count
    if abs(bend) * length_m < 1e-6:
        places, normals = path.contacts[-1] + along * travel, np.tile(normal, (count, 1))
        ahead = np.tile(travel, (count, 1))
    else:
        angle, radius = bend * along, 1.0 / bend
        sine, cosine = np.sin(angle), np.cos(angle)
        places = path.contacts[-1] + radius * (sine * travel + (1.0 - cosine) * normal)
        normals = cosine * normal - sine * travel
        ahead = cosine * travel + sine * normal
    places = places + height_m * (along / length_m) ** 2 * normals
    if free is not None:
        allowed = np.asarray(free(places, ahead, normals), bool)
        last = len(places) if allowed.all() else int(np.argmin(allowed))
        places, normals = places[:last], normals[:last]
    return SurfacePath(places, normals)


def _end_of(path: SurfacePath, length_m: float) -> tuple[np.ndarray, float]:
    """Direction of travel (3,), square to the normal, at a path's end, and the bend there, 1/m,
    above 0 where it bends towards the normal: of a parabola through its last points."""
    back = arc_length(path.contacts[::-1])
    count = max(int(np.searchsorted(back, length_m, side="right")), _WINDOW + 1)
    window = path.contacts[::-1][:count]
    along, normal = -back[: len(window), None], path.normals[-1]
    away = window - path.contacts[-1]
    if len(window) > 2:
        slope, curve = np.linalg.lstsq(np.hstack([along, 0.5 * along**2]), away, rcond=None)[0]
    else:
        slope, curve = -away[-1], np.zeros(3)
    travel = unit_vectors(slope - (slope @ normal) * normal)
    most = _MOST_BEND_RAD / length_m
    return np.asarray(travel), float(np.clip(curve @ normal, -most, most))
