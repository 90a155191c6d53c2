"""Mean correspondence error against exact truth, on unseen members of the parametric families."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nrdf.errors import DataError
from nrdf.io.cloud import PointCloud
from nrdf.regions.model import Model
from nrdf.shapes.families import get_family

FIRST_SEED = 1_000_000
"""Members from this seed on are never trained on (`nrdf model synth` starts at 0)."""
CLOUD_POINTS = 8192
COMPARED_POINTS = 2048


@dataclass(frozen=True)
class FamilyResult:
    """Distances in canonical lengths (longest side 1), one value a pair: (pairs,).

    field: of C's prediction from the exact position; box: of the copy scaled to the target's
    bounding box; shared: share of the reference's surface points that the target has at all.
    """

    category: str
    field: np.ndarray
    box: np.ndarray
    shared: np.ndarray

    @property
    def ratio(self) -> float:
        """How many times closer C is than the bounding box copy, of the means."""
        return float(self.box.mean() / self.field.mean())


def evaluate_family(
    model: Model,
    category: str,
    pairs: int = 50,
    progress: Callable[[int, int], None] | None = None,
) -> FamilyResult:
    """Ask C for exact correspondences of `pairs` pairs of unseen members.

    Each reference is a cloud of its own surface, its normals known; points that the target lacks
    ("none") are left out of the error. `progress` is told (done, all). Raises DataError for a
    category without a family, or no pairs.
    """
    if pairs < 1:
        raise DataError(f"{pairs} pairs asked for; give at least 1")
    family = get_family(category)
    rows = []
    for number in range(pairs):
        reference = family.member(FIRST_SEED + 2 * number)
        target = family.member(FIRST_SEED + 2 * number + 1)
        rng = np.random.default_rng(FIRST_SEED + number)
        surface = reference.sample_surface(CLOUD_POINTS, rng)
        other = target.sample_surface(CLOUD_POINTS, rng)
        truth = target.locate(surface.coordinates)
        shared = np.flatnonzero(truth.exists)
        chosen = rng.permutation(shared)[:COMPARED_POINTS]
        encoded_reference = model.set_reference(PointCloud(surface.points, surface.normals))
        encoded = model.encode(PointCloud(other.points, other.normals))
        mapped = encoded.original(encoded_reference.map_points(chosen, encoded).points)
        low, high = surface.points.min(0), surface.points.max(0)
        other_low, other_high = other.points.min(0), other.points.max(0)
        box = (surface.points[chosen] - low) / (high - low) * (other_high - other_low) + other_low
        exact = truth.points[chosen]
        rows.append(
            (
                np.linalg.norm(mapped - exact, axis=1).mean(),
                np.linalg.norm(box - exact, axis=1).mean(),
                len(shared) / len(surface.points),
            )
        )
        if progress is not None:
            progress(number + 1, pairs)
    field, box_error, share = np.array(rows).T
    return FamilyResult(category, field, box_error, share)
