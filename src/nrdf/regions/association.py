"""From a mapped reference to the target's own points (paper, section III-D and eq. 9)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

NORMAL_WEIGHT = 0.1
"""Canonical length that one unit of normal difference counts for: tells thin sides apart."""
VOTERS = 7
"""Mapped reference points that each target point asks."""
# How far a target point may be from the mapped reference and still have a counterpart on it:
# canonical length, and multiple of the error that the field expects there.
_SLACK = 0.02
_REACH = 1.75


# Trees are asked by one thread: an interrupt would free the arrays under scipy's other threads.


def oriented_features(points: np.ndarray, normals: np.ndarray, weight: float) -> np.ndarray:
    """Positions and weighted normals side by side, (n, 6), for nearest neighbours in both.

    With weight 0 only the positions, (n, 3), which is faster.
    """
    return np.concatenate([points, weight * normals], axis=1) if weight else points


def snap(
    mapped: np.ndarray,
    mapped_normals: np.ndarray,
    target: np.ndarray,
    target_normals: np.ndarray,
    normal_weight: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Each mapped point's nearest target point: its index (m,) and distance (m,).

    mapped (m, 3), target (n, 3) canonical; normals of the same shapes, used when `normal_weight`
    is above 0.
    """
    tree = cKDTree(oriented_features(target, target_normals, normal_weight))
    distance, index = tree.query(oriented_features(mapped, mapped_normals, normal_weight))
    return index, distance


def voters(
    mapped: np.ndarray,
    mapped_normals: np.ndarray,
    target: np.ndarray,
    target_normals: np.ndarray,
    normal_weight: float = NORMAL_WEIGHT,
    count: int = VOTERS,
) -> tuple[np.ndarray, np.ndarray]:
    """For each target point, the mapped reference points nearest in (position, normal).

    Returns their indices (n, count) into `mapped` and distances (n, count).
    """
    tree = cKDTree(oriented_features(mapped, mapped_normals, normal_weight))
    distance, index = tree.query(
        oriented_features(target, target_normals, normal_weight),
        k=np.arange(1, min(count, len(mapped)) + 1),
    )
    return index, distance


def explained_by(distance: np.ndarray, error: np.ndarray) -> np.ndarray:
    """Which target points (n,) have a counterpart on the reference, and not a part of their own, as
    a spoiler or a canard is.

    distance: (n, count) to the mapped points that each asked (`voters`); error: (n, count) that the
    field expects of these. Where it expects none, it says nothing of the kind and explains all.
    """
    expected = error.mean(axis=1)
    return (distance.mean(axis=1) <= _SLACK + _REACH * expected) | (expected == 0)
