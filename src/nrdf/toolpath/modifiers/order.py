"""Order: which path comes next, and from which end, so that the ways between are short."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.toolpath.surface_path import SurfacePath

_MOST_TURNED, _ROUNDS = 500, 2  # paths of which runs are turned, and how often, for each of them
_LEAST_GAIN_M = 1e-6


def order_nearest(
    paths: Sequence[SurfacePath], one_way: bool = False, lift_m: float = 0.0
) -> list[SurfacePath]:
    """The same paths in a shorter order: from each one's end to the nearest end of another.

    Paths may be driven backwards, unless `one_way`. The first one stays first. An order that is
    not shorter than the one that was given is not taken. lift_m: ways are measured that far above
    the surface, so that the two sides of a thin sheet are as far apart as they are for a tool.
    """
    if len(paths) < 3:
        return list(paths)
    ends = _ends(paths, lift_m)
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
    return ordered if way_between(ordered, lift_m) < way_between(paths, lift_m) else list(paths)


def order_shortest(
    paths: Sequence[SurfacePath], one_way: bool = False, lift_m: float = 0.0
) -> list[SurfacePath]:
    """The same paths in the shortest order that is found: nearest next, then runs of them turned
    around wherever that makes the ways between shorter.

    As `order_nearest` says of the first path, of `one_way`, with which no runs are turned, and of
    `lift_m`.
    """
    ordered = order_nearest(paths, one_way, lift_m)
    if one_way or not 2 < len(ordered) <= _MOST_TURNED:
        return ordered
    starts, stops = _ends(ordered, lift_m).transpose(1, 0, 2).copy()
    number, backwards = np.arange(len(ordered)), np.zeros(len(ordered), bool)
    for _ in range(_ROUNDS * len(ordered)):
        i, j, gain = _best_turn(starts, stops)
        if gain < _LEAST_GAIN_M:
            break
        run = slice(i, j + 1)
        starts[run], stops[run] = stops[run][::-1].copy(), starts[run][::-1].copy()
        number[run], backwards[run] = number[run][::-1].copy(), ~backwards[run][::-1]
    return [
        ordered[k].reversed() if turned else ordered[k]
        for k, turned in zip(number, backwards, strict=True)
    ]


def _best_turn(starts: np.ndarray, stops: np.ndarray) -> tuple[int, int, float]:
    """The run of paths, from i to j, that saves most if driven from its end, and how much, m."""
    count = len(starts)
    before = np.linalg.norm(stops[:-1, None] - stops[None, 1:], axis=2)  # (i - 1, j)
    after = np.linalg.norm(starts[1:, None] - starts[None, 1:], axis=2)  # (i, j + 1)
    now = np.linalg.norm(starts[1:] - stops[:-1], axis=1)
    # Row i - 1 and column j - 1: the run from i to j; the last one is followed by nothing.
    gain = now[:, None] - before
    gain[:, :-1] += now[None, 1:] - after[:, 1:]
    gain[np.tril_indices(count - 1, -1)] = -np.inf
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return int(i) + 1, int(j) + 1, float(gain[i, j])


def way_between(paths: Sequence[SurfacePath], lift_m: float = 0.0) -> float:
    """The straight ways from each path's end to the next one's start, `lift_m` above them, m."""
    ends = _ends(paths, lift_m)
    return float(np.linalg.norm(ends[1:, 0] - ends[:-1, 1], axis=1).sum())


def _ends(paths: Sequence[SurfacePath], lift_m: float) -> np.ndarray:
    """Where each path starts and stops (p, 2, 3), lifted along the normals."""
    at = [path.contacts[[0, -1]] + lift_m * path.normals[[0, -1]] for path in paths]
    return np.array(at).reshape(-1, 2, 3)
