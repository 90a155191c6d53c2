"""Join: paths that follow each other closely are driven as one, without lifting between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nrdf.geometry.frames import angles_between, unit_vectors
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.surface_path import SurfacePath

Project = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""The nearest places (n, 3) on the surface for points and outward normals (n, 3), the normals
there, and which of them are the region's (n,)."""
LARGEST_TURN_RAD = float(np.radians(60.0))
_STRETCH = 1.5  # steps of a way on the surface, over those of the straight way


def join(
    paths: Sequence[SurfacePath],
    project: Project,
    spacing_m: float,
    largest_gap_m: float,
    largest_turn_rad: float = LARGEST_TURN_RAD,
) -> list[SurfacePath]:
    """Paths in the same order, those joined whose end and next start are close.

    The points between, at most `spacing_m` apart, are projected to the surface, so that nothing
    leads through the air or through the part. A gap above `largest_gap_m`, or a turn of the normal
    above `largest_turn_rad`, stays a gap; so does one whose way leaves the region, or jumps on it.
    Turned to drive on from the nearer end, each path after the first may be driven backwards.
    """
    joined: list[SurfacePath] = []
    for path in paths:
        if not joined:
            joined.append(path)
            continue
        last = joined[-1]
        place = last.contacts[-1]
        near, far = (np.linalg.norm(path.contacts[k] - place) for k in (0, -1))
        path = path if near <= far else path.reversed()
        way = _way(last, path, project, spacing_m, largest_gap_m, largest_turn_rad)
        if way is None:
            joined.append(path)
            continue
        joined[-1] = SurfacePath(
            np.concatenate([last.contacts, way.contacts, path.contacts]),
            np.concatenate([last.normals, way.normals, path.normals]),
        )
    return joined


def _way(
    last: SurfacePath,
    path: SurfacePath,
    project: Project,
    spacing_m: float,
    largest_gap_m: float,
    largest_turn_rad: float,
) -> SurfacePath | None:
    """The points between two paths, maybe none of them; None where they stay apart."""
    start, stop = last.contacts[-1], path.contacts[0]
    gap = float(np.linalg.norm(stop - start))
    if gap > largest_gap_m:
        return None
    if angles_between(last.normals[-1:], path.normals[:1])[0] > largest_turn_rad:
        return None
    count = int(np.ceil(gap / spacing_m - 1e-9)) + 1
    share = np.linspace(0.0, 1.0, max(count, 2))[1:-1, None]
    normals = unit_vectors((1.0 - share) * last.normals[-1] + share * path.normals[0])
    places, outward, there = project((1.0 - share) * start + share * stop, normals)
    whole = np.concatenate([[start], places, [stop]])
    if not there.all() or step_lengths(whole).max() > _STRETCH * spacing_m:
        return None
    return SurfacePath(places, outward)
