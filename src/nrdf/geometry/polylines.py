"""Lines through points: how long they are, and the same line in even steps.

A line is an array (n, d) of points in their order; its arc length counts from its first point.
"""

from __future__ import annotations

import numpy as np


def step_lengths(line: np.ndarray) -> np.ndarray:
    """Distances (n - 1,) from each point of a line (n, d) to the next, in its unit."""
    way = np.asarray(line)[1:] - np.asarray(line)[:-1]
    return np.sqrt(np.einsum("na,na->n", way, way))  # several times as fast as norm


def longest_step(line: np.ndarray) -> float:
    """The longest distance between neighbours of a line (n, d), 0 for a single point."""
    return float(step_lengths(line).max(initial=0.0))


def total_length(line: np.ndarray) -> float:
    """Length of a line (n, d), 0 for a single point."""
    return float(step_lengths(line).sum())


def arc_length(line: np.ndarray) -> np.ndarray:
    """Length (n,) of a line (n, d) up to each of its points."""
    return summed(step_lengths(line))


def summed(steps: np.ndarray) -> np.ndarray:
    """Sums (n + 1,) of steps (n,) up to each of them, from 0."""
    return np.concatenate([[0.0], np.cumsum(steps)])


def even_arc_lengths(
    total: float, spacing: float, nearest: bool = False, least: int = 1
) -> np.ndarray:
    """Arc lengths (m,) from 0 to `total` in even steps, at least `least` of them.

    Each step is `spacing` long at most; with `nearest`, as near to it as even steps can be.
    """
    count = float(np.rint(total / spacing) if nearest else np.ceil(total / spacing))
    return np.linspace(0.0, total, max(int(count), least) + 1)


def interpolate(at: np.ndarray, along: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (m, d) at arc lengths `at` (m,), from `values` (n, d) at ascending `along` (n,)."""
    return np.stack([np.interp(at, along, column) for column in np.asarray(values).T], axis=1)


def resample(line: np.ndarray, spacing: float, nearest: bool = False) -> np.ndarray:
    """The points (m, d) of a line (n, d) in even steps; its ends stay.

    spacing, nearest: as for `even_arc_lengths`, in the line's unit.
    """
    along = arc_length(line)
    return interpolate(even_arc_lengths(float(along[-1]), spacing, nearest), along, line)
