"""Feeds that make a process's result even: least squares on the time spent along a path.

Film and depth are sums over the moves, each in proportion to its slowness (s/m). So the slowness of
every move is what is solved for: the squared deviation from the target over the region's area, more
where the tolerance is not kept, a little for what is wasted beside the region and for change from
move to move, within the limits on speed (L-BFGS-B: Byrd et al., 1995). Acceleration above what is
allowed costs too; a pass forwards and one backwards takes away the last of it. Solved again with
less weight on what was outside the tolerance (iteratively reweighted least squares): a place that
the lines do not reach would else get its film at its neighbours' cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_matrix, diags

from nrdf.errors import ProcessError
from nrdf.process_model.moves import Moves
from nrdf.toolpath.types import ACCELERATION_M_S2

_KEPT = 0.3  # share of the tolerance from which a deviation costs more
_MORE = 30.0  # times
_ALLOWED, _LIMIT = 0.9, 1.0  # share of the acceleration allowed; what it costs to have more
_SHORTEST_M = 1e-4
_STEPS = 250
_ROUNDS = 3


@dataclass(frozen=True)
class FeedLimits:
    """What tool and robot can do. least_m_s, most_m_s: speed along lines; acceleration_m_s2: along
    the line, and across it at its turns. Raises ProcessError for limits that leave no speed."""

    least_m_s: float = 0.01
    most_m_s: float = 1.0
    acceleration_m_s2: float = ACCELERATION_M_S2

    def __post_init__(self) -> None:
        if not 0.0 < self.least_m_s <= self.most_m_s < 100.0:
            raise ProcessError(
                f"feeds from {self.least_m_s:g} to {self.most_m_s:g} m/s; give a least feed above "
                "0 and a most feed that is not less"
            )
        if not 0.0 < self.acceleration_m_s2 < 1e4:
            raise ProcessError(
                f"an acceleration of {self.acceleration_m_s2:g} m/s²; give one above 0"
            )


@dataclass(frozen=True)
class FeedWeights:
    """What else counts, beside the squared deviation's mean over the area. spill: film wasted for
    film wanted; change: mean squared change of slowness from move to move, in typical ones; apart:
    mean squared distance from the typical one, so that no line runs fast beside slow ones."""

    spill: float = 0.05
    change: float = 0.02
    apart: float = 0.05


def plan_feeds(
    matrix: csr_matrix,
    fixed: np.ndarray,
    areas_m2: np.ndarray,
    spill_m3: np.ndarray,
    target_m: float,
    tolerance_m: float,
    moves: Moves,
    limits: FeedLimits,
    weights: FeedWeights | None = None,
) -> np.ndarray:
    """Feeds (m,), m/s, of all moves.

    matrix: (n, m), m², from slowness to film on the region's cells; fixed: (n,), m, what dwells
    leave there; areas_m2: (n,). spill_m3: (m,) what each move leaves elsewhere, for each second a
    metre. Never raises for a target out of reach: the feeds are then the nearest within the limits.
    """
    weights = weights or FeedWeights()
    share = areas_m2 / areas_m2.sum()
    usual = usual_slowness(matrix, fixed, areas_m2, target_m, limits)
    per = matrix.multiply(usual / target_m).tocsr()
    back = per.T.tocsr()
    start = fixed / target_m - 1.0
    band = _KEPT * tolerance_m / target_m
    wasted = weights.spill * spill_m3 * usual / (target_m * areas_m2.sum())
    change = _changes(moves, weights.change)
    pull = (change.T @ change).tocsr()

    fastest = np.sqrt(_most_at_turns(moves, limits))
    lowest = np.clip(
        1.0 / fastest / usual, 1.0 / limits.most_m_s / usual, 1.0 / limits.least_m_s / usual
    )
    highest = np.full(len(lowest), 1.0 / limits.least_m_s / usual)
    joined, gain = _gains(moves, limits)
    first, second = joined, joined + 1

    def cost(x: np.ndarray) -> tuple[float, np.ndarray]:
        off = per @ x + start
        beyond = np.sign(off) * np.maximum(np.abs(off) - band, 0.0)
        pulled = pull @ x
        apart = x - 1.0
        value = share @ (off**2 + _MORE * beyond**2) + wasted @ x + x @ pulled
        value += weights.apart * float(apart @ apart) / len(x)
        slope = back @ (2.0 * share * (off + _MORE * beyond)) + wasted + 2.0 * pulled
        slope += 2.0 * weights.apart / len(x) * apart
        squared = (usual * x) ** -2
        rise = (squared[second] - squared[first]) / gain
        over = np.sign(rise) * np.maximum(np.abs(rise) - _ALLOWED, 0.0)
        value += _LIMIT * float(over @ over) / len(x)
        push = 2.0 * _LIMIT / len(x) * over / gain
        by_squared = np.bincount(second, push, len(x)) - np.bincount(first, push, len(x))
        slope += by_squared * -2.0 * squared / x
        return float(value), slope

    bounds = np.stack([lowest, highest], axis=1)
    x = np.clip(np.ones(len(lowest)), lowest, highest)
    for _ in range(_ROUNDS):
        options = {"maxiter": _STEPS, "maxcor": 20}
        x = minimize(cost, x, jac=True, method="L-BFGS-B", bounds=bounds, options=options).x
        # What no feed brings within the tolerance must not take others out of it.
        far = np.abs(per @ x + start) * target_m / tolerance_m
        share = areas_m2 / areas_m2.sum() / np.maximum(far, 1.0) ** 2
    feeds = within_acceleration(np.minimum(1.0 / (usual * x), fastest), moves, limits)
    return np.asarray(np.clip(feeds, limits.least_m_s, limits.most_m_s))


def usual_slowness(
    matrix: csr_matrix,
    fixed: np.ndarray,
    areas_m2: np.ndarray,
    target_m: float,
    limits: FeedLimits,
) -> float:
    """The one slowness, s/m, of all moves with which half of the region's area has the target or
    more, within the limits. Raises ProcessError where the path leaves nothing on half of it."""
    each = np.asarray(matrix.sum(axis=1)).ravel()
    wanted = np.where(each > 0.0, np.maximum(target_m - fixed, 0.0), np.inf)
    needed = wanted / np.where(each > 0.0, each, 1.0)
    order = np.argsort(needed)
    summed = np.cumsum(areas_m2[order])
    middle = float(needed[order[int(np.searchsorted(summed, 0.5 * summed[-1]))]])
    if not np.isfinite(middle):
        raise ProcessError(
            "the path leaves nothing on more than half of its region: lines too far apart, or a "
            "tool that does not reach it"
        )
    return float(np.clip(middle, 1.0 / limits.most_m_s, 1.0 / limits.least_m_s))


def within_acceleration(feeds: np.ndarray, moves: Moves, limits: FeedLimits) -> np.ndarray:
    """Feeds (m,) no faster than given ones, and with no more than the acceleration allowed: along
    the way, and across it where it turns, as on an arc through the two moves' middles."""
    squared = np.minimum(feeds**2, _most_at_turns(moves, limits))
    gain = np.full(max(len(squared) - 1, 0), np.inf)
    joined, gain[joined] = _gains(moves, limits)
    # v² may rise by 2 a d: the least, over all moves before, of their v² and the rise since.
    for backwards in (False, True):
        values, rise = (squared[::-1], gain[::-1]) if backwards else (squared, gain)
        kept = values.copy()
        for k in range(len(rise)):
            limit = kept[k] + rise[k]
            if kept[k + 1] > limit:
                kept[k + 1] = limit
        squared = kept[::-1].copy() if backwards else kept
    return np.asarray(np.sqrt(squared))


def _gains(moves: Moves, limits: FeedLimits) -> tuple[np.ndarray, np.ndarray]:
    """Moves (g,) that go on in another one, and by how much (g,) v² may change between the two."""
    joined = np.flatnonzero(moves.segment[1:] == moves.segment[:-1])
    between = 0.5 * (moves.lengths_m[joined] + moves.lengths_m[joined + 1])
    return joined, 2.0 * limits.acceleration_m_s2 * np.maximum(between, _SHORTEST_M)


def _most_at_turns(moves: Moves, limits: FeedLimits) -> np.ndarray:
    """The largest v² (m,) at a move's turns, as on an arc through the middles of its moves."""
    joined, gain = _gains(moves, limits)
    turn = moves.turns_rad[joined]
    most = np.where(turn > 1e-3, 0.5 * gain / np.maximum(turn, 1e-3), np.inf)
    squared = np.full(len(moves.lengths_m), np.inf)
    squared[joined + 1] = most
    squared[joined] = np.minimum(squared[joined], most)
    return np.clip(squared, limits.least_m_s**2, limits.most_m_s**2)


def _changes(moves: Moves, weight: float) -> csr_matrix:
    """Differences (d, m) of neighbouring moves of a segment, so that their squared sum is
    weighted and a mean over the way."""
    count = len(moves.lengths_m)
    joined = np.flatnonzero(moves.segment[1:] == moves.segment[:-1])
    if not len(joined):
        return csr_matrix((0, count))
    scale = np.sqrt(weight / count)
    all_of_them = diags([-scale, scale], [0, 1], shape=(count - 1, count)).tocsr()
    return all_of_them[joined]
