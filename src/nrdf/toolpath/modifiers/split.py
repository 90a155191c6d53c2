"""Split: a path ends where its next step or turn would be too large, and another one begins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.geometry.frames import angles_between
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.surface_path import SurfacePath

LEAST_STEP_M = 1e-4
"""Shorter steps count as that long where a turn is divided by them."""


def split(
    paths: Sequence[SurfacePath],
    largest_step_m: float,
    largest_turn_rad_m: float = np.inf,
) -> list[SurfacePath]:
    """Paths without a step above `largest_step_m`, or a turn of the normal above
    `largest_turn_rad_m` for each m of the way. Single points that this leaves are dropped."""
    kept = []
    for path in paths:
        steps = step_lengths(path.contacts)
        rates = turns(path.normals) / np.maximum(steps, LEAST_STEP_M)
        kept += cut(path, (steps > largest_step_m) | (rates > largest_turn_rad_m))
    return kept


def cut(path: SurfacePath, after: np.ndarray) -> list[SurfacePath]:
    """The pieces of a path of n points that is cut at those of its steps (n - 1,); pieces of one
    point are dropped."""
    if not after.any():
        return [path]
    runs = np.split(np.arange(len(path.contacts)), np.flatnonzero(after) + 1)
    return [path.part(run) for run in runs if len(run) > 1]


def turns(directions: np.ndarray) -> np.ndarray:
    """Angles (n - 1,), rad, between unit directions (n, 3) that follow each other."""
    return angles_between(directions[:-1], directions[1:])
