"""From a mapped reference to the target's own points (paper, section III-D and eq. 9)."""

from __future__ import annotations

import numpy as np

from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud
from nrdf.geometry.normals import oriented_features, oriented_tree, search_tree
from nrdf.regions.mapping import MappedPoints

VOTING_NEIGHBOURS = 7
"""Reference points on the target that vote on each target point (k-nearest voting)."""

# Canonical length that one unit of difference in local shape counts for: a multiple of the error
# that is expected of the map, and what it is where nothing predicts one. Where a map is exact its
# places decide; the less it can be believed, the more a leg's points come from a leg.
_SHAPE_PER_ERROR = 2.0
_SHAPE_WEIGHT = 0.05

# Trees are queried by one thread: an interrupt would free the arrays under scipy's other threads.


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
    tree = oriented_tree(target, target_normals, normal_weight)
    distance, index = tree.query(oriented_features(mapped, mapped_normals, normal_weight))
    return index, distance


def nearest_voters(
    mapped: np.ndarray,
    mapped_normals: np.ndarray,
    target: np.ndarray,
    target_normals: np.ndarray,
    normal_weight: float = NORMAL_WEIGHT,
    count: int = VOTING_NEIGHBOURS,
) -> tuple[np.ndarray, np.ndarray]:
    """The mapped reference points that vote on each target point: nearest in position and normal.

    mapped (m, 3), target (n, 3) canonical, with their normals. Returns the voters' indices
    (n, count) into `mapped` and distances (n, count).
    """
    tree = oriented_tree(mapped, mapped_normals, normal_weight)
    distance, index = tree.query(
        oriented_features(target, target_normals, normal_weight),
        k=np.arange(1, min(count, len(mapped)) + 1),
    )
    return index, distance


def alike_voters(
    mapped: MappedPoints, source: EncodedCloud, target: EncodedCloud
) -> tuple[np.ndarray, np.ndarray]:
    """The mapped points of a source that vote on each target point: nearest in position, normal
    and local shape.

    Returns the voters' indices (n, `VOTING_NEIGHBOURS`) and distances in position and normal.
    """
    expected = float(mapped.error.mean())
    weight = _SHAPE_PER_ERROR * expected if expected > 0.0 else _SHAPE_WEIGHT
    shapes, target_shapes = source.alike_features(target)
    places = oriented_features(mapped.points, mapped.normals, NORMAL_WEIGHT)
    wanted = oriented_features(target.points, target.normals, NORMAL_WEIGHT)
    index = search_tree(np.concatenate([places, weight * shapes], axis=1)).query(
        np.concatenate([wanted, weight * target_shapes], axis=1),
        k=np.arange(1, min(VOTING_NEIGHBOURS, len(places)) + 1),
    )[1]
    return index, np.linalg.norm(places[index] - wanted[:, None], axis=2)
