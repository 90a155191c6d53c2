"""Smooth orientation: the tool's axis turns no faster than a limit, and no farther off than one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.geometry.frames import angles_between, unit_vectors
from nrdf.geometry.polylines import arc_length, step_lengths
from nrdf.toolpath.modifiers.split import LEAST_STEP_M, cut, turns
from nrdf.toolpath.strategy import LARGEST_TURN_RAD_M
from nrdf.toolpath.surface_path import SurfacePath

LARGEST_TILT_RAD = float(np.radians(35.0))
_ROUNDS, _CLOSE = 400, 1e-3  # of the relaxation, and the share of the limit that is left over


def smooth_orientation(
    paths: Sequence[SurfacePath],
    largest_turn_rad_m: float = LARGEST_TURN_RAD_M,
    largest_tilt_rad: float = LARGEST_TILT_RAD,
) -> list[SurfacePath]:
    """Paths whose normals turn by at most `largest_turn_rad_m` for each m of the way.

    The normals next to a sharp turn are turned towards each other; contacts stay where they are.
    Where a normal would be more than `largest_tilt_rad` off its own, the path is split at the
    sharpest turn instead.
    """
    smooth: list[SurfacePath] = []
    waiting = list(paths)[::-1]
    while waiting:
        path = waiting.pop()
        allowed = largest_turn_rad_m * np.maximum(step_lengths(path.contacts), LEAST_STEP_M)
        found = turns(path.normals)
        if (found <= allowed).all():
            smooth.append(path)
            continue
        normals = turned_steadily(path.normals, allowed)
        off = angles_between(path.normals, normals)
        settled = (turns(normals) <= allowed).all()
        if settled and off.max() <= largest_tilt_rad:
            smooth.append(replace(path, normals=normals))
            continue
        sharpest = np.arange(len(found)) == np.argmax(found / allowed)
        waiting += cut(path, sharpest)[::-1]
    return smooth


def steady_normals(paths: Sequence[SurfacePath], reach_m: float) -> list[SurfacePath]:
    """Paths whose normals are averaged that far to either side along them, the near ones most.

    Towards an end over what there is of the line. Closed paths stay as they are; a reach of 0
    changes nothing.
    """
    return [path if path.closed else _steady(path, reach_m) for path in paths]


def _steady(path: SurfacePath, reach_m: float) -> SurfacePath:
    if reach_m <= 0.0 or len(path.contacts) < 3:
        return path
    along = arc_length(path.contacts)
    away = np.abs(along[None] - along[:, None]) / reach_m
    weights = np.maximum(1.0 - away, 0.0)
    return replace(path, normals=unit_vectors(weights @ path.normals))


def turned_steadily(normals: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Normals (n, 3) turned until neighbours differ by at most `allowed` (n - 1,), rad, if the
    rounds suffice for that.

    Every second pair at a time, whose ends share the excess of their turn.
    """
    normals, target = normals.copy(), (1.0 - _CLOSE) * allowed
    pairs = [np.arange(first, len(allowed), 2) for first in (0, 1)]
    for _ in range(_ROUNDS):
        for i in pairs:
            one, other = normals[i], normals[i + 1]
            turn = angles_between(one, other)
            wide = turn > target[i]
            if not wide.any():
                continue
            i, one, other, turn = i[wide], one[wide], other[wide], turn[wide]
            share = (0.5 * (1.0 - target[i] / turn))[:, None]
            angle, sine = turn[:, None], np.maximum(np.sin(turn), 1e-9)[:, None]
            near, far = np.sin((1.0 - share) * angle) / sine, np.sin(share * angle) / sine
            normals[i] = unit_vectors(near * one + far * other)
            normals[i + 1] = unit_vectors(near * other + far * one)
        if (turns(normals) <= allowed).all():
            break
    return normals
