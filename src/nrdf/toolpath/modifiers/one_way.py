"""One way, and the start: which end every path begins at, and which corner the first one does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.toolpath.surface_path import SurfacePath


def one_way(paths: Sequence[SurfacePath], direction: np.ndarray) -> list[SurfacePath]:
    """Paths in the same order, each driven along a direction (3,) rather than against it.

    Closed paths all run the same way around: against the clock, seen from outside.
    """
    turned = []
    for path in paths:
        if path.closed:
            away = path.contacts - path.contacts.mean(axis=0)
            area = np.cross(away[:-1], away[1:]).sum(axis=0)
            against = float(area @ path.normals.mean(axis=0)) < 0.0
        else:
            against = float((path.contacts[-1] - path.contacts[0]) @ direction) < 0.0
        turned.append(path.reversed() if against else path)
    return turned


def begun_near(paths: Sequence[SurfacePath]) -> list[SurfacePath]:
    """Paths in the same order, each closed one begun at its contact nearest to where the one before
    ends."""
    begun: list[SurfacePath] = []
    for path in paths:
        if path.closed and begun:
            away = np.linalg.norm(path.contacts[:-1] - begun[-1].contacts[-1], axis=1)
            path = path.from_contact(int(np.argmin(away)))
        begun.append(path)
    return begun


def start_at(
    paths: Sequence[SurfacePath], towards: np.ndarray, may_turn: bool = True
) -> list[SurfacePath]:
    """The same paths, so turned that the first point lies farthest `towards` a direction (3,).

    The whole order may be reversed, and, unless `may_turn` is false, every path driven from its
    other end, so that neighbours stay neighbours.
    """
    if not paths:
        return []
    ways = [list(paths), list(paths)[::-1]]
    if may_turn:
        ways += [[path.reversed() for path in way] for way in ways]
    towards = unit_vectors(np.asarray(towards, dtype=np.float64))
    # Of ways that are equally good, the first.
    heights = np.array([way[0].contacts[0] @ towards for way in ways])
    return ways[int(np.argmax(heights > heights.max() - 1e-9))]
