"""The order in which a planner's lines are driven: as a snake, part by part."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from nrdf.toolpath.surface_path import SurfacePath

_BESIDE, _SHARE = 1.5, 0.3
"""Lines are next to each other where they are less than that many stepovers apart, along at least
that share of the shorter one."""


def snake_order(
    paths: Sequence[SurfacePath], levels: Sequence[int], stepover_m: float
) -> list[SurfacePath]:
    """Paths so ordered and turned that each starts near the end of the one before.

    levels: number of each path's line; paths of neighbouring numbers that lie side by side are
    driven one after the other, every second one backwards. What a hole leaves on either side is
    driven whole before the other side.
    """
    waiting = _chains(paths, _links(paths, levels, stepover_m))
    ordered: list[SurfacePath] = []
    while waiting:
        best, away = (0, False, False), np.inf
        if ordered:
            place = ordered[-1].contacts[-1]
            for number, chain in enumerate(waiting):
                for backwards in (False, True):
                    path = paths[chain[-1 if backwards else 0]]
                    for turned in (False, True):
                        start = _start(path, turned, place)
                        far = float(np.linalg.norm(start - place))
                        if far < away:
                            best, away = (number, backwards, turned), far
        number, backwards, turned = best
        chain = waiting.pop(number)
        for index in chain[::-1] if backwards else chain:
            path = paths[index]
            if ordered:
                place = ordered[-1].contacts[-1]
                if path.closed:
                    path = started_near(path, place)
                else:
                    ends = np.linalg.norm(path.contacts[[0, -1]] - place, axis=1)
                    path = path.reversed() if ends[1] < ends[0] else path
            ordered.append(path)
    return ordered


def started_near(path: SurfacePath, place: np.ndarray) -> SurfacePath:
    """A closed path from its contact nearest to a place (3,)."""
    first = int(np.argmin(np.linalg.norm(path.contacts[:-1] - place, axis=1)))
    return path.from_contact(first)


def _start(path: SurfacePath, turned: bool, place: np.ndarray) -> np.ndarray:
    if path.closed:
        return started_near(path, place).contacts[0]
    return np.asarray(path.contacts[-1 if turned else 0])


def _links(
    paths: Sequence[SurfacePath], levels: Sequence[int], stepover_m: float
) -> dict[int, list[int]]:
    """For each path those beside it, the one along most of it first."""
    owner = np.repeat(np.arange(len(paths)), [len(path.contacts) for path in paths])
    links: dict[int, list[int]] = defaultdict(list)
    if not len(owner):
        return links
    tree = cKDTree(np.concatenate([path.contacts for path in paths]))
    pairs = tree.query_pairs(_BESIDE * stepover_m, output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    level = np.asarray(levels)[owner]
    one, other = pairs.T
    kept = (np.abs(level[one] - level[other]) <= 1) & (owner[one] != owner[other])
    places = np.unique(np.stack([one[kept], owner[other[kept]]], axis=1), axis=0)
    beside, count = np.unique(
        np.stack([owner[places[:, 0]], places[:, 1]], axis=1), axis=0, return_counts=True
    )
    size = np.bincount(owner, minlength=len(paths))
    share = count / np.minimum(size[beside[:, 0]], size[beside[:, 1]]) if len(beside) else count
    for k in np.argsort(-count, kind="stable"):
        if share[k] >= _SHARE:
            links[int(beside[k, 0])].append(int(beside[k, 1]))
    return links


def _chains(paths: Sequence[SurfacePath], links: dict[int, list[int]]) -> list[list[int]]:
    """Paths in rows of neighbours, from those with the fewest neighbours on."""
    left = set(range(len(paths)))
    chains = []
    while left:
        at = min(left, key=lambda k: (len([n for n in links[k] if n in left]), k))
        chain = []
        while True:
            chain.append(at)
            left.discard(at)
            following = [n for n in links[at] if n in left]
            if not following:
                break
            at = following[0]
        chains.append(chain)
    return chains
