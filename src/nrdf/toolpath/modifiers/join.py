"""Join: paths that follow each other closely are driven as one, without lifting between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

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
    may_turn: bool = True,
) -> list[SurfacePath]:
    """Paths in the same order, those joined whose end and next start are close.

    The points between, at most `spacing_m` apart, are projected to the surface, so that nothing
    leads through the air or through the part. A gap above `largest_gap_m`, or a turn of the normal
    above `largest_turn_rad`, stays a gap; so does one whose way leaves the region, or jumps on it.
    Turned to drive on from the nearer end, each path after the first may be driven backwards, if
    `may_turn`.
    """
    if not paths:
        return []
    turned = [paths[0]]
    for path in paths[1:]:
        place = turned[-1].contacts[-1]
        near, far = (np.linalg.norm(path.contacts[k] - place) for k in (0, -1))
        turned.append(path.reversed() if may_turn and far < near else path)
    ways = _ways(turned, project, spacing_m, largest_gap_m, largest_turn_rad)
    joined: list[list[SurfacePath]] = [[turned[0]]]
    for way, path in zip(ways, turned[1:], strict=True):
        if way is None:
            joined.append([path])
        else:
            joined[-1] += [way, path]
    return [
        run[0]
        if len(run) == 1
        else SurfacePath(
            np.concatenate([path.contacts for path in run]),
            np.concatenate([path.normals for path in run]),
        )
        for run in joined
    ]


def _ways(
    paths: Sequence[SurfacePath],
    project: Project,
    spacing_m: float,
    largest_gap_m: float,
    largest_turn_rad: float,
) -> list[SurfacePath | None]:
    """The points between each path and the next, maybe none of them; None where they stay apart."""
    ways: list[SurfacePath | None] = [None] * (len(paths) - 1)
    straight: list[tuple[int, np.ndarray, np.ndarray]] = []
    for number, (last, path) in enumerate(pairwise(paths)):
        start, stop = last.contacts[-1], path.contacts[0]
        gap = float(np.linalg.norm(stop - start))
        if gap > largest_gap_m:
            continue
        if angles_between(last.normals[-1:], path.normals[:1])[0] > largest_turn_rad:
            continue
        count = int(np.ceil(gap / spacing_m - 1e-9)) + 1
        share = np.linspace(0.0, 1.0, max(count, 2))[1:-1, None]
        normals = unit_vectors((1.0 - share) * last.normals[-1] + share * path.normals[0])
        straight.append((number, (1.0 - share) * start + share * stop, normals))
    if not straight:
        return ways
    # All at once: a projection costs little more for many points than for one.
    cuts = np.cumsum([len(points) for _, points, _ in straight])[:-1]
    asked = [np.concatenate(kind) for kind in list(zip(*straight, strict=True))[1:]]
    found = zip(*(np.split(kind, cuts) for kind in project(*asked)), strict=True)
    for (number, _, normals), (places, outward, there) in zip(straight, found, strict=True):
        ends = paths[number].contacts[-1:], paths[number + 1].contacts[:1]
        steps = step_lengths(np.concatenate([ends[0], places, ends[1]]))
        if there.all() and steps.max() <= _STRETCH * spacing_m:
            # On an edge of the part the side beyond it is as near: the tool stays on this one.
            aside = angles_between(outward, normals) > largest_turn_rad
            ways[number] = SurfacePath(places, np.where(aside[:, None], normals, outward))
    return ways
