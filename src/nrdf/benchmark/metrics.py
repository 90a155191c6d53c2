"""How far a retrieved region is from the true one. All in the unit of the points given."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree


def chamfer_l1(found: np.ndarray, truth: np.ndarray) -> float:
    """The paper's CD-L1 of two point sets (n, 3) and (m, 3).

    Manhattan distance of every point to its nearest (in that distance) neighbour in the other
    set, averaged over the points, summed over the two directions ("the L1 version of (3)"). A
    point that occurs several times counts as often. Raises ValueError for an empty set.
    """
    if len(found) == 0 or len(truth) == 0:
        raise ValueError(f"no Chamfer distance of {len(found)} points from {len(truth)}")
    return _mean_nearest(found, truth) + _mean_nearest(truth, found)


def _mean_nearest(points: np.ndarray, others: np.ndarray) -> float:
    distance, _ = cKDTree(others).query(points, p=1)
    return float(distance.mean())
