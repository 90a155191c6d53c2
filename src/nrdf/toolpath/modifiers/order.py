"""Order: which path comes next, and from which end, so that the ways between are short."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.toolpath.modifiers.join import LARGEST_TURN_RAD
from nrdf.toolpath.surface_path import SurfacePath

_MOST_TURNED, _ROUNDS = 500, 2  # paths of which runs are turned, and how often, for each of them
_LEAST_GAIN_M = 1e-6


@dataclass(frozen=True)
class Lift:
    """Where the tool lifts, and how far: a way then leads up by height_m along the normal, across
    and down again, so that the two sides of a thin sheet are as far apart as they are for a tool. A
    way up to gap_m, over which the normal turns by less than turn_rad, is driven without lifting.
    """

    height_m: float = 0.0
    gap_m: float = 0.0
    turn_rad: float = LARGEST_TURN_RAD

    def cost(self, stops: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """Of ways from ends (..., 2, 3) to ends (..., 2, 3), m; each a place and its normal."""
        far = _length(stops[..., 0, :] - starts[..., 0, :])
        alike = np.einsum("...a,...a->...", stops[..., 1, :], starts[..., 1, :])
        driven = (far <= self.gap_m) & (alike > np.cos(self.turn_rad))
        above = [end[..., 0, :] + self.height_m * end[..., 1, :] for end in (stops, starts)]
        lifted = _length(above[0] - above[1]) + 2.0 * self.height_m
        return np.asarray(np.where(driven, far, lifted))


def order_nearest(
    paths: Sequence[SurfacePath], one_way: bool = False, lift: Lift = Lift()
) -> list[SurfacePath]:
    """The same paths, from each one's end on to the nearest end of one that is left.

    Paths may be driven backwards, unless `one_way`. The first one stays first. lift: what counts
    beside the ways.
    """
    if len(paths) < 3:
        return list(paths)
    ends = np.stack([_ends(paths, 0), _ends(paths, -1)], axis=1)
    waiting = np.ones(len(paths), bool)
    ordered, place, which, backwards = [paths[0]], ends[0, 1], 0, False
    for _ in range(len(paths) - 1):
        waiting[which] = False
        left = np.flatnonzero(waiting)
        away = lift.cost(place, ends[left])
        if one_way:
            away[:, 1] = np.inf
        k, end = np.unravel_index(int(np.argmin(away)), away.shape)
        which, backwards = int(left[k]), bool(end)
        ordered.append(paths[which].reversed() if backwards else paths[which])
        place = ends[which, 0 if backwards else 1]
    return ordered


def order_shortest(
    paths: Sequence[SurfacePath], one_way: bool = False, lift: Lift = Lift()
) -> list[SurfacePath]:
    """The same paths in the shortest order that is found: nearest next, or as they are given where
    that is shorter; then runs of them turned around wherever that makes the ways between shorter.

    As `order_nearest` says of the first path, of `one_way`, for which no run is turned, and `lift`.
    """
    tries = [list(paths), order_nearest(paths, one_way, lift)]
    ordered = min(tries, key=lambda tried: way_between(tried, lift))
    if one_way or not 2 < len(ordered) <= _MOST_TURNED:
        return ordered
    starts, stops = _ends(ordered, 0), _ends(ordered, -1)
    number, backwards = np.arange(len(ordered)), np.zeros(len(ordered), bool)
    for _ in range(_ROUNDS * len(ordered)):
        i, j, gain = _best_turn(starts, stops, lift)
        if gain < _LEAST_GAIN_M:
            break
        run = slice(i, j + 1)
        starts[run], stops[run] = stops[run][::-1].copy(), starts[run][::-1].copy()
        number[run], backwards[run] = number[run][::-1].copy(), ~backwards[run][::-1]
    return [
        ordered[k].reversed() if turned else ordered[k]
        for k, turned in zip(number, backwards, strict=True)
    ]


def way_between(paths: Sequence[SurfacePath], lift: Lift = Lift()) -> float:
    """The straight ways from each path's end to the next one's start, m, lifting counted."""
    return float(lift.cost(_ends(paths, -1)[:-1], _ends(paths, 0)[1:]).sum())


def _ends(paths: Sequence[SurfacePath], which: int) -> np.ndarray:
    """The first (0) or last (-1) place of each path, and the normal there, (p, 2, 3)."""
    both = [(path.contacts[which], path.normals[which]) for path in paths]
    return np.array(both).reshape(-1, 2, 3)


def _best_turn(starts: np.ndarray, stops: np.ndarray, lift: Lift) -> tuple[int, int, float]:
    """The run of paths, from i to j, that saves most if driven from its end, and how much, m."""
    count = len(starts)
    before = lift.cost(stops[:-1, None], stops[None, 1:])  # (i - 1, j - 1)
    after = lift.cost(starts[1:, None], starts[None, 1:])  # (i - 1, j)
    now = lift.cost(stops[:-1], starts[1:])
    # Row i - 1 and column j - 1: the run from i to j; the last one is followed by nothing.
    gain = now[:, None] - before
    gain[:, :-1] += now[None, 1:] - after[:, 1:]
    gain[np.tril_indices(count - 1, -1)] = -np.inf
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return int(i) + 1, int(j) + 1, float(gain[i, j])


def _length(ways: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...a,...a->...", ways, ways))
