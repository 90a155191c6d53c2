"""Resample: as few waypoints as a chord error and a turn allow, those that are there already."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.toolpath.modifiers.split import turns
from nrdf.toolpath.surface_path import SurfacePath


def resample(
    paths: Sequence[SurfacePath],
    chord_error_m: float,
    largest_turn_rad: float,
    largest_step_m: float = np.inf,
) -> list[SurfacePath]:
    """Paths of fewer of their own points.

    No point that is left out is farther than `chord_error_m` from the straight way that replaces
    it; over none of these does the normal turn by more than `largest_turn_rad`, all turns added;
    none is longer than `largest_step_m`, unless it was. Ends stay.
    """
    return [_resampled(path, chord_error_m, largest_turn_rad, largest_step_m) for path in paths]


def _resampled(
    path: SurfacePath, chord_error_m: float, largest_turn_rad: float, largest_step_m: float
) -> SurfacePath:
    turned = np.concatenate([[0.0], np.cumsum(turns(path.normals))])
    kept = kept_waypoints(path.contacts, turned, chord_error_m, largest_turn_rad, largest_step_m)
    return replace(path, contacts=path.contacts[kept], normals=path.normals[kept])


def kept_waypoints(
    contacts: np.ndarray,
    turned: np.ndarray,
    chord_error_m: float,
    largest_turn_rad: float,
    largest_step_m: float = np.inf,
) -> np.ndarray:
    """Which (k,) of contacts (n, 3), m, stay, as `resample` says; turned: (n,), rad, the sum of
    all turns up to each."""
    kept, last = [0], len(contacts) - 1
    while kept[-1] < last:
        start = kept[-1]
        stop = start + 1
        while (
            stop < last
            and turned[stop + 1] - turned[start] <= largest_turn_rad
            and np.linalg.norm(contacts[stop + 1] - contacts[start]) <= largest_step_m
            and _sag(contacts[start : stop + 2]) <= chord_error_m
        ):
            stop += 1
        kept.append(stop)
    return np.array(kept)


def _sag(points: np.ndarray) -> float:
    """The largest distance, m, of points (n, 3) from the straight way between their ends."""
    along = points[-1] - points[0]
    offset = points[1:-1] - points[0]
    share = np.clip(offset @ along / max(float(along @ along), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(offset - share[:, None] * along, axis=1).max(initial=0.0))
