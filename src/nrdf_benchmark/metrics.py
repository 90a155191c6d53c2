"""How far a retrieved region is from the true one, in the unit of the points given.

Formulas and their sources: docs/evidence/bsrc.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from nrdf.field.encoded_cloud import NORMAL_WEIGHT
from nrdf.geometry.normals import oriented_features
from nrdf_benchmark.bsrc.dataset import OPPOSITE_SIDES, ROIS, BenchmarkObject

VERSION = 1
"""Raised when a metric's value changes: results of different versions are not mixed."""
MISSED = 1.0
"""Chamfer distance that a region found nowhere is counted with: about the object's own length."""
SIDE_REACH = 0.05
"""Retrieved points farther than this from both sides of a thin part say nothing about sides."""


@dataclass(frozen=True)
class Metric:
    """title: what a table calls it; formula: in a line; missed: its value where nothing is found,
    None where it then has none."""

    title: str
    formula: str
    higher_is_better: bool = False
    missed: float | None = MISSED
    digits: int = 4


METRICS = {
    "cd-l1": Metric(
        "CD-L1",
        "Manhattan distance to the nearest neighbour in the other set, mean over the points, "
        "summed over both directions (the paper's convention)",
    ),
    "chamfer-l1": Metric(
        "Chamfer-L1",
        "Euclidean distance to the nearest neighbour in the other set, mean over the points, mean "
        "of both directions (Occupancy Networks' convention)",
    ),
    "squared-cd": Metric(
        "squared CD",
        "squared Euclidean distance to the nearest neighbour in the other set, mean over the "
        "points, summed over both directions (the paper's eq. 3)",
        digits=5,
    ),
    "f-score-0.01": Metric(
        "F-score at 0.01",
        "harmonic mean of the shares of found points within 0.01 of the true region and of true "
        "points within 0.01 of the found one (Tatarchenko et al. 2019)",
        True, 0.0,
    ),
    "f-score-0.02": Metric(
        "F-score at 0.02",
        "harmonic mean of the shares of found points within 0.02 of the true region and of true "
        "points within 0.02 of the found one (Tatarchenko et al. 2019)",
        True, 0.0,
    ),
    "precision": Metric(
        "precision", "share of the target's points found that are in the true region", True, 0.0
    ),
    "recall": Metric(
        "recall", "share of the true region's points that are found", True, 0.0
    ),
    "iou": Metric(
        "IoU", "the target's points both found and true, over those either found or true", True, 0.0
    ),
    "side-accuracy": Metric(
        "side accuracy",
        "share of found points on the true side of a thin part, of those near it",
        True, None,
    ),
}  # fmt: skip
"""By name, in the order of the results' columns."""


class Directed(NamedTuple):
    """Each point's distance to its nearest neighbour in the other set: to_truth (n,) of the found
    points, to_found (m,) of the true ones."""

    to_truth: np.ndarray
    to_found: np.ndarray


def directed(found: np.ndarray, truth: np.ndarray, order: int = 2) -> Directed:
    """Nearest-neighbour distances between points (n, 3) and (m, 3), both ways.

    order: 1 Manhattan, 2 Euclidean. A point that occurs several times counts as often. Raises
    ValueError for an empty set.
    """
    if len(found) == 0 or len(truth) == 0:
        raise ValueError(f"no distance of {len(found)} points from {len(truth)}")
    return Directed(
        cKDTree(truth).query(found, p=order)[0], cKDTree(found).query(truth, p=order)[0]
    )


def chamfer_l1(found: np.ndarray, truth: np.ndarray) -> float:
    """The paper's CD-L1 of two point sets (n, 3) and (m, 3): "the L1 version of (3)".

    Manhattan distance of every point to its nearest (in that distance) neighbour in the other
    set, averaged over the points, summed over the two directions. Raises ValueError for an empty
    set.
    """
    distance = directed(found, truth, 1)
    return float(distance.to_truth.mean() + distance.to_found.mean())


def halved_chamfer(distance: Directed) -> float:
    """Chamfer-L1 of Occupancy Networks (Mescheder et al. 2019) from Euclidean distances."""
    return float(distance.to_truth.mean() + distance.to_found.mean()) / 2


def squared_chamfer(distance: Directed) -> float:
    """Chamfer distance as the paper's eq. 3 has it, from Euclidean distances."""
    return float((distance.to_truth**2).mean() + (distance.to_found**2).mean())


def f_score(distance: Directed, threshold: float) -> float:
    """F-score at a threshold (Tatarchenko et al. 2019) from Euclidean distances, in [0, 1]."""
    precision = float((distance.to_truth < threshold).mean())
    recall = float((distance.to_found < threshold).mean())
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


def overlap(found: np.ndarray, truth: np.ndarray) -> tuple[float, float, float]:
    """Precision, recall and intersection over union of two sets of a target's points.

    found, truth: indices, neither empty; one that occurs several times counts once.
    """
    common = len(np.intersect1d(found, truth))
    found_count, true_count = len(np.unique(found)), len(np.unique(truth))
    union = found_count + true_count - common
    return common / found_count, common / true_count, common / union


def side_accuracy(
    points: np.ndarray,
    normals: np.ndarray,
    found: np.ndarray,
    side: np.ndarray,
    opposite: np.ndarray,
) -> float | None:
    """Share of a target's retrieved points that lie on the true side of a thin part.

    points, normals: (n, 3) of the target, unit outward normals; found: indices retrieved for a
    region; side, opposite: indices of that region and of the one on the part's other side. Counted
    are the retrieved points within `SIDE_REACH` of either. One is on the true side if, of the
    points of both, the nearest in (x, 0.1·normal) belongs to `side`. None if no point counts.
    """
    tree = cKDTree(points[np.union1d(side, opposite)])
    near = found[tree.query(points[found])[0] <= SIDE_REACH]
    if len(near) == 0:
        return None
    features = oriented_features(points, normals, NORMAL_WEIGHT)
    to_side, to_opposite = (
        cKDTree(features[indices]).query(features[near])[0] for indices in (side, opposite)
    )
    return float((to_side <= to_opposite).mean())


def score(
    found: np.ndarray, target: BenchmarkObject, roi: str, category: str
) -> dict[str, float | None]:
    """Every metric of `METRICS` for one region found on a target, None where it has no value.

    found: indices of the target's points; where they repeat, distances count them as often.
    """
    if len(found) == 0:
        return {name: metric.missed for name, metric in METRICS.items()}
    points, truth = target.cloud.points[found], target.regions[roi]
    euclidean = directed(points, truth)
    precision, recall, iou = overlap(found, target.truth[roi])
    return {
        "cd-l1": chamfer_l1(points, truth),
        "chamfer-l1": halved_chamfer(euclidean),
        "squared-cd": squared_chamfer(euclidean),
        "f-score-0.01": f_score(euclidean, 0.01),
        "f-score-0.02": f_score(euclidean, 0.02),
        "precision": precision,
        "recall": recall,
        "iou": iou,
        "side-accuracy": _side_accuracy(found, target, roi, category),
    }


def defined_for(metric: str, category: str) -> tuple[str, ...]:
    """The regions of a category that a metric has a value for."""
    if metric == "side-accuracy":
        return tuple(roi for roi in ROIS[category] if opposite_of(roi, category))
    return ROIS[category]


def opposite_of(roi: str, category: str) -> str | None:
    """The region on the other side of a thin part, if the region is such a side."""
    for first, second in OPPOSITE_SIDES[category]:
        if roi in (first, second):
            return second if roi == first else first
    return None


def _side_accuracy(
    found: np.ndarray, target: BenchmarkObject, roi: str, category: str
) -> float | None:
    opposite = opposite_of(roi, category)
    if opposite is None:
        return None
    assert target.cloud.normals is not None  # read_bsrc estimates them
    return side_accuracy(
        target.cloud.points, target.cloud.normals, found, target.truth[roi], target.truth[opposite]
    )
