"""How many objects a cloud holds: what stands beside something else of its size is another one."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError, cKDTree

from nrdf.geometry.canonical import bounding_box
from nrdf.geometry.sampling import downsample, one_per_cell
from nrdf.io.cloud import PointCloud

_POINTS = 8192
_NEIGHBOURS = 8
# In distances between points: on 147 real shapes of 2048 points or more, none comes apart into
# parts of comparable size from 1.9 on.
_LINKED = 2.2
_GAP = 0.03  # of the largest part: a narrower gap is one within an object
_CELL = _GAP / 4  # of the whole cloud's longest side
_SHARE, _SIZE = 0.15, 0.5
"""Shares of the largest part's points, evenly spread, and of its size, from which one counts."""
_ALIKE = 0.45
"""Least ratio between the extents of two objects."""


def count_objects(cloud: PointCloud, up: np.ndarray | None = None) -> int:
    """How many objects of comparable size a cloud holds: 1 or more.

    Objects are apart if nowhere nearer than 5 % of their size, and than about three distances
    between points. Parts of which one is much flatter or thinner than the other are one object. So
    are, where up, (3,) unit, is known, parts over or under each other: what joins them was not
    seen.
    """
    return int(separate_objects(cloud.points, up).max()) + 1


def separate_objects(points: np.ndarray, up: np.ndarray | None = None) -> np.ndarray:
    """Which object of comparable size each of points (n, 3) belongs to, (n,): 0 is the largest.

    What is smaller belongs to the nearest of them. up: as of `count_objects`.
    """
    few = points[downsample(points, _POINTS, np.random.default_rng(0))]
    low, high = bounding_box(few)
    side = float((high - low).max())
    if side == 0.0:
        return np.zeros(len(points), dtype=np.int64)
    # Where very many lie close together, a few stand for them.
    few = few[one_per_cell(few, low, _CELL * side)]
    label = _parts(few)
    if label.max() > 0:
        label = _put_together(few, label, up)
    if label.max() == 0:
        return np.zeros(len(points), dtype=np.int64)
    kept = label >= 0
    return label[kept][cKDTree(few[kept]).query(points)[1]]


def _parts(points: np.ndarray) -> np.ndarray:
    """The part (n,) that each point belongs to, -1 for what is too small for one."""
    tree = cKDTree(points)
    distance, near = tree.query(points, min(_NEIGHBOURS + 1, len(points)))
    own = distance[:, -1] * np.sqrt(np.pi / _NEIGHBOURS)
    own = np.median(own[near], axis=1)
    own = np.minimum(own, 2.0 * np.median(own))
    gap = 0.0
    while True:
        label, sizes = _linked(tree, own, gap)
        largest = _size(points[label == 0])
        if _GAP * largest <= gap:
            break
        gap = _GAP * largest
    large = [
        part
        for part in np.flatnonzero(sizes >= _SHARE * sizes[0])
        if _size(points[label == part]) >= _SIZE * largest
    ]
    number = np.full(len(sizes), -1)
    number[large] = np.arange(len(large))
    return number[label]


def _linked(tree: cKDTree, own: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Components (n,) of points nearer than `gap` or some of their `own` spacings (n,), the one of
    most points being 0, and their numbers of points."""
    reach = np.maximum(_LINKED * own, gap)
    pairs = tree.query_pairs(float(reach.max()), output_type="ndarray")
    i, j = pairs.T
    apart = np.linalg.norm(tree.data[i] - tree.data[j], axis=1)
    pairs = pairs[apart <= np.minimum(reach[i], reach[j])]
    return _components(pairs, tree.n)


def _components(pairs: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Components (count,) of a graph of `pairs` (e, 2), the largest being 0, and their sizes."""
    graph = coo_matrix((np.ones(len(pairs), bool), pairs.T), (count, count))
    label = connected_components(graph, directed=False)[1]
    sizes = np.bincount(label)
    order = np.argsort(-sizes, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[label], sizes[order]


def _size(points: np.ndarray) -> float:
    """About the largest distance between two of the points, in any pose."""
    return 2.0 * float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())


def _put_together(points: np.ndarray, part: np.ndarray, up: np.ndarray | None) -> np.ndarray:
    """Objects (n,) out of the parts (n,) of points, -1 staying so."""
    while True:
        count = int(part.max()) + 1
        clouds = [points[part == number] for number in range(count)]
        together = [
            (i, j)
            for i in range(count)
            for j in range(i + 1, count)
            if _unlike(clouds[i], clouds[j])
            or (up is not None and _stacked(clouds[i], clouds[j], up))
        ]
        if not together:
            return part
        label = connected_components(
            coo_matrix((np.ones(len(together), bool), np.transpose(together)), (count, count)),
            directed=False,
        )[1]
        sizes = np.bincount(label[part[part >= 0]])
        rank = np.argsort(np.argsort(-sizes, kind="stable"))
        part = np.where(part < 0, -1, rank[label[part]])


def _stacked(one: np.ndarray, other: np.ndarray, up: np.ndarray) -> bool:
    """Whether one of two parts reaches into the other's outline, seen along `up`."""
    axes = np.linalg.svd(up[None])[2][1:]
    one, other = one @ axes.T, other @ axes.T
    return _reaches_into(one, other) or _reaches_into(other, one)


def _reaches_into(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether points (n, 2) are within the convex outline of others."""
    try:
        sides = ConvexHull(other).equations
    except QhullError:  # a line
        return False
    return bool((one @ sides[:, :2].T + sides[:, 2] < 0.0).all(axis=1).any())


def _unlike(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two parts differ so much in an extent that they are hardly two objects of a kind."""
    extents = [np.linalg.svd(part - part.mean(axis=0), compute_uv=False) for part in (one, other)]
    first, second = (e / np.sqrt(len(p)) for e, p in zip(extents, (one, other), strict=True))
    return bool((np.minimum(first, second) < _ALIKE * np.maximum(first, second)).any())
