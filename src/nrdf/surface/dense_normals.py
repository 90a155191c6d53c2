"""Normals of all points of a scan, by those that were found for a few of them.

A slat of 10 mm is thinner than the few points are apart, so the nearest of them is as often on its
other side. Each point's own neighbours give the line of its normal; where sensors stood, or the few
points on the same sheet, give its sign.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.normals import consensus, estimate_normals, principal_normals
from nrdf.surface.scan_points import for_parts

_DENSER = 3  # times as many points as have normals, from which a cloud has lines of its own
_CELL = 0.35  # spacings of the few points: one normal for all points of a cell
_NEIGHBOURS, _ASKED = 16, 6  # cells around one, and few points that tell its sign
_OTHER = 0.1  # weight of cells that seem to look elsewhere
_LEVEL, _NEAR = 0.25, 1.5  # spacings from a few point's plane, and from it, that count


def dense_normals(
    points: np.ndarray, few: np.ndarray, normals: np.ndarray, sensors: np.ndarray | None = None
) -> np.ndarray:
    """Outward unit normals (n, 3) of points (n, 3), m, of a cloud.

    few: (k, 3), m, points of the same object with outward normals (k, 3). sensors: (s, 3), m,
    where it was seen from, if that is known: they tell the two sides of a thin sheet apart better.
    """
    tree = cKDTree(few)
    if len(points) < _DENSER * len(few):
        return np.asarray(normals[tree.query(points)[1]])
    away = tree.query(few, [8])[0]
    spacing = max(float(np.median(away)) * np.sqrt(np.pi / 7.0), 1e-9)
    places, number = _cells(points, _CELL * spacing)
    if len(places) <= len(few):
        return np.asarray(normals[tree.query(points)[1]])
    if sensors is not None:
        return estimate_normals(places, sensors=sensors)[number]
    dense = cKDTree(places, balanced_tree=False, compact_nodes=False)
    lines = np.empty(places.shape)
    index = np.empty((len(places), _NEIGHBOURS), np.int32)
    closeness = np.empty((len(places), _NEIGHBOURS), np.float32)
    sign = np.empty(len(places))
    rough = normals[tree.query(places)[1]]

    def work(part: slice) -> None:
        apart, index[part] = dense.query(places[part], _NEIGHBOURS)
        closeness[part] = np.exp(-((apart / (apart[:, _NEIGHBOURS // 2, None] + 1e-12)) ** 2))
        # The surface around an edge is not that of both of its sides.
        alike = np.maximum(np.einsum("nka,na->nk", rough[index[part]], rough[part]), _OTHER)
        lines[part] = principal_normals(places, index[part], (closeness[part] + 1e-6) * alike**2)
        far, near = tree.query(places[part], _ASKED)
        offset = places[part][:, None] - few[near]
        own = lines[part][:, :, None]
        rise = np.maximum(
            np.abs((offset * normals[near]).sum(axis=2)), np.abs((offset @ own)[..., 0])
        )
        facing = (normals[near] @ own)[..., 0]
        weight = np.exp(-((rise / (_LEVEL * spacing)) ** 2) - (far / (_NEAR * spacing)) ** 2)
        sign[part] = np.clip((weight * facing * np.abs(facing)).sum(axis=1), -1.0, 1.0)

    for_parts(work, len(places))
    sign = consensus(sign, places, lines, index, closeness, _LEVEL * spacing)
    return np.asarray((np.where(sign < 0.0, -1.0, 1.0)[:, None] * lines)[number])


def _cells(points: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """The mean (k, 3) of the points in each cell of a grid, and the cell (n,) of each point."""
    low = points.min(axis=0)
    size = max(size, float(np.ptp(points, axis=0).max()) / (1 << 20))
    place = np.floor((points - low) / size).astype(np.int64)
    key = place @ np.array([1 << 42, 1 << 21, 1])
    _, number, count = np.unique(key, return_inverse=True, return_counts=True)
    number = number.reshape(-1)
    mean = [np.bincount(number, points[:, axis]) / count for axis in range(3)]
    return np.stack(mean, axis=1), number
