"""From what a sensor delivers to the one object in it: each step reports, and can be left out."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from nrdf.errors import CloudError, unknown_name
from nrdf.geometry.canonical import bounding_box
from nrdf.geometry.sampling import downsample
from nrdf.io.cloud import PointCloud, check_coordinates
from nrdf.scans.floor import Plane, find_floor
from nrdf.scans.objects import separate_objects

STEPS = ("thin", "duplicates", "floor", "outliers", "objects")
MOST_POINTS = 200_000
"""What a scan is thinned to, evenly; the field itself looks at far fewer."""
WORKING_POINTS = 30_000
"""Points that decisions are made on; those between follow the nearest of them."""
_NEIGHBOURS = 12
_SPARSER = 2.5  # times the neighbours' distances to theirs, from which a point is an outlier
_GAP = 0.05  # of the longest side: parts nearer to each other than this are one object
_FLATTER = 0.25  # heights count for less: parts above each other are one object
_BETWEEN = 2.0  # distances between kept points within which a thinned one is of the object too


@dataclass(frozen=True)
class Step:
    """What one step of cleaning did: its name, how many points it removed, and why."""

    name: str
    removed: int
    note: str


@dataclass(frozen=True)
class Cleaned:
    """The object in a scan.

    cloud: its points; kept: (k,) their indices in the scan, ascending. steps: what was done.
    floor: the plane it stands on, None if none was seen or looked for. others: how many more
    objects of a comparable size there were.
    """

    cloud: PointCloud
    kept: np.ndarray
    steps: tuple[Step, ...]
    floor: Plane | None
    others: int


def unthinned(scan: PointCloud, cleaned: Cleaned) -> PointCloud:
    """All points of a scan that are the object's: those that were kept, and, where the scan was
    thinned, those between them."""
    if not any(step.name == "thin" and step.removed for step in cleaned.steps):
        return cleaned.cloud
    tree = cKDTree(cleaned.cloud.points)
    apart = float(np.median(tree.query(cleaned.cloud.points, 2)[0][:, 1]))
    near = tree.query(scan.points, distance_upper_bound=_BETWEEN * apart)[0]
    return scan.select(np.isfinite(near))


def clean_scan(
    scan: PointCloud,
    up: np.ndarray | None = None,
    skip: Collection[str] = (),
    minimum_points: int = 256,
    number: int = 0,
) -> Cleaned:
    """Thin a scan, and leave out repeated points, the floor, outliers, and all objects but one.

    up: (3,) unit vector, None if unknown. skip: those of `STEPS` to leave out. number: of the
    object that is taken, 0 for the largest. Raises CloudError for an unknown step, coordinates that
    nothing can be computed of, an object that is not there, or where fewer than `minimum_points`
    remain (naming the step that took most).
    """
    for name in skip:
        if name not in STEPS:
            raise CloudError(unknown_name("step of cleaning", name, STEPS))
    check_coordinates(scan)
    rng = np.random.default_rng(0)
    kept = np.arange(len(scan))
    steps: list[Step] = []
    floor, others = None, 0

    def keep(name: str, mask: np.ndarray, note: str) -> None:
        nonlocal kept
        steps.append(Step(name, int((~mask).sum()), note))
        kept = kept[mask]
        if len(kept) < minimum_points:
            worst = max(steps, key=lambda step: step.removed)
            raise CloudError(
                f"of {len(scan)} points {len(kept)} remain, at least {minimum_points} are needed: "
                f"the step '{worst.name}' removed {worst.removed} ({worst.note}). Is there an "
                f"object in the scan? --skip {worst.name} leaves that step out"
            )

    if "thin" not in skip:
        mask = np.zeros(len(kept), bool)
        mask[downsample(scan.points, MOST_POINTS, rng)] = True
        keep("thin", mask, f"{MOST_POINTS} points, evenly spread, are enough")
    if "duplicates" not in skip:
        mask = _first_of_equal(scan.points[kept])
        keep("duplicates", mask, "the same coordinates as another point")
    if "floor" not in skip:
        floor = find_floor(scan.points[kept], up, rng)
        if floor is None:
            steps.append(Step("floor", 0, "no plane was seen that carries the rest"))
        else:
            above = floor.height(scan.points[kept]) > floor.thickness
            keep("floor", above, "on or under the plane that carries the rest")
            up = floor.normal if up is None else up
    working = kept[downsample(scan.points[kept], WORKING_POINTS, rng)]
    if "outliers" not in skip:
        bad = _outliers(scan.points[working])
        mask = ~bad[_follow(scan.points[kept], scan.points[working])]
        keep("outliers", mask, "far from their neighbours")
        working = working[~bad]
    if "objects" not in skip:
        apart = separate_objects(scan.points[working], up)
        others = int(apart.max())
        if not 0 <= number <= others:
            raise CloudError(f"there is no object {number + 1}: the scan has {others + 1}")
        own = np.flatnonzero(apart == number)
        label, count = _objects(scan.points[working[own]], up)
        largest = np.zeros(len(working), bool)
        largest[own[label == 0]] = True
        mask = largest[_follow(scan.points[kept], scan.points[working])]
        count += others
        chosen = f"number {1 + number}" if number else "the largest"
        note = f"not of {chosen} of {count} objects" if count > 1 else "one object"
        keep("objects", mask, note)
    return Cleaned(scan.select(kept), kept, tuple(steps), floor, others)


def _first_of_equal(points: np.ndarray) -> np.ndarray:
    """Mask (n,) of the points whose coordinates no earlier point has."""
    rows = np.ascontiguousarray(points + 0.0).view(np.dtype((np.void, 24))).ravel()
    mask = np.zeros(len(points), bool)
    mask[np.unique(rows, return_index=True)[1]] = True
    return mask


def _follow(points: np.ndarray, working: np.ndarray) -> np.ndarray:
    """The working point (n,) that each point follows."""
    return cKDTree(working).query(points)[1]


def _outliers(points: np.ndarray) -> np.ndarray:
    """Mask (n,) of points that are much farther from their neighbours than those are from theirs.

    A surface that is seen at a slant is sparse all over, so distances are compared with those of
    the neighbourhood (as in the local outlier factor, Breunig et al. 2000).
    """
    count = min(_NEIGHBOURS + 1, len(points))
    distance, index = cKDTree(points).query(points, count)
    own = distance[:, 1:].mean(axis=1)
    around = np.median(own[index[:, 1:]], axis=1)
    return (own > _SPARSER * around) & (own > _SPARSER * np.median(own))


def _objects(points: np.ndarray, up: np.ndarray | None) -> tuple[np.ndarray, int]:
    """Which object, however small, each point belongs to (n,), the largest being 0; their number.

    Cells of a voxel grid belong together if they are nearer than a gap; with `up` (3,), heights
    count for less, and what lies over or under the largest object is part of it: a foot whose leg
    was hidden.
    """
    low, high = bounding_box(points)
    gap = _GAP * float((high - low).max())
    if up is not None:
        points = points - (1 - _FLATTER) * np.outer(points @ up, up)
    cells, cell = np.unique(np.floor(points / (gap / 2)), axis=0, return_inverse=True)
    pairs = cKDTree(cells).query_pairs(2.5, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs), bool), pairs.T), (len(cells), len(cells)))
    label = connected_components(graph, directed=False)[1]
    if up is not None:
        label = _with_what_is_above(cells * (gap / 2), label, up, gap)
    sizes = np.bincount(label)
    rank = np.argsort(np.argsort(-sizes, kind="stable"))
    return rank[label][cell.ravel()], len(sizes)


def _with_what_is_above(
    places: np.ndarray, label: np.ndarray, up: np.ndarray, gap: float
) -> np.ndarray:
    """Labels (n,) in which the largest object has taken over those that reach into its outline,
    seen along `up` (3,)."""
    axes = np.linalg.svd(up[None])[2][1:]
    flat = places @ axes.T
    while True:
        sizes = np.bincount(label)
        largest = int(sizes.argmax())
        own = flat[label == largest]
        if len(own) < 3 or np.ptp(own, axis=0).min() == 0.0:
            return label
        hull = ConvexHull(own, qhull_options="QJ")
        outside = flat @ hull.equations[:, :2].T + hull.equations[:, 2]
        within = np.bincount(label, outside.max(axis=1) < gap, len(sizes)) > 0
        within[largest] = False
        if not within.any():
            return label
        label = np.unique(np.where(within[label], largest, label), return_inverse=True)[1]
