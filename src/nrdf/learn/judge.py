"""How far models are off, on objects that none of them has learned from.

Truth is known where a held-out object is mapped onto a copy of itself that is scaled, stretched and
bent by a known map, and sampled anew: the place of every point is exact. Between different objects
nothing is given that is true. There it is told how far mapped points lie off the target, in
position and normal, and how far they come back from their own place; what is known of real parts
says that this tells right from wrong (`nrdf.regions.registration_mapper`).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from nrdf.io.cloud import PointCloud
from nrdf.learn.objects import cloud_of
from nrdf.regions.model import Model
from nrdf.regions.registration_mapper import CYCLE_WEIGHT
from nrdf.shapes.dataset import Shape
from nrdf.shapes.registration import DisplacementInterpolator
from nrdf.training.augment import draw_deformation
from nrdf.training.config import AugmentConfig

COPIES = 4
"""Deformed copies of each held-out object."""
REFERENCES = 3
"""Training objects that each held-out one is paired with."""
_CHANGES = AugmentConfig(scaling=0.2, warp=0.03, stretch=0.35)
_COMPARED = 1024  # points of each pair


@dataclass(frozen=True)
class Errors:
    """In longest sides, a row for each held-out object, (objects, models).

    exact: mean distance from the exact place, on deformed copies. doubt: of different objects, how
    far a point lies off the target and comes back from its own place.
    """

    names: tuple[str, ...]
    models: tuple[str, ...]
    exact: np.ndarray
    doubt: np.ndarray

    def describe(self) -> dict[str, Any]:
        """What a report says."""
        return {
            "held_out": list(self.names),
            "models": list(self.models),
            "exact": self.exact.round(5).tolist(),
            "doubt": self.doubt.round(5).tolist(),
        }


def measure(
    models: dict[str, Model],
    held_out: Sequence[Shape],
    others: Sequence[Shape],
    progress: Callable[[int, int], None] | None = None,
) -> Errors:
    """Errors of models by name on held-out shapes, and between them and `others`, which were
    trained on. All clouds are without normals, as a scan is. `progress` is told (done, all)."""
    exact = np.zeros((len(held_out), len(models)))
    doubt = np.zeros_like(exact)
    for row, shape in enumerate(held_out):
        rng = np.random.default_rng(zlib.crc32(shape.name.encode()))
        references = rng.permutation(len(others))[:REFERENCES]
        copies = [deformed_copy(shape, number) for number in range(COPIES)]
        for column, model in enumerate(models.values()):
            exact[row, column] = np.mean([_exact_error(model, *copy) for copy in copies])
            doubt[row, column] = np.mean(
                [_doubt(model, cloud_of(others[n], False), cloud_of(shape, False))
                 for n in references]
            )  # fmt: skip
        if progress is not None:
            progress(row + 1, len(held_out))
    return Errors(tuple(s.name for s in held_out), tuple(models), exact, doubt)


def deformed_copy(shape: Shape, number: int) -> tuple[PointCloud, PointCloud, np.ndarray]:
    """A reference (n, 3), the same object deformed and sampled elsewhere (n, 3), both without
    normals, and the exact places (n, 3) of the reference's points on it."""
    generator = torch.Generator().manual_seed(zlib.crc32(f"{shape.name} {number}".encode()))
    surface = torch.from_numpy(shape.surface_points)[None].float()
    map_ = draw_deformation(_CHANGES, surface, torch.ones(1), generator)
    moved = map_.points(surface)[0].double().numpy()
    order = torch.randperm(surface.shape[1], generator=generator).numpy()
    half = len(order) // 2
    own = np.asarray(shape.surface_points, np.float64)[order[:half]]
    return PointCloud(own), PointCloud(moved[order[half:]]), moved[order[:half]]


def difference(errors: np.ndarray, column: int, than: int) -> tuple[float, float]:
    """By how much one model's errors (objects, models) are above another's, in the mean, and the
    half width of its 95 % interval over the objects (infinite for one object)."""
    apart = errors[:, column] - errors[:, than]
    if len(apart) < 2:
        return float(apart.mean()), float("inf")
    from scipy.stats import t

    half = t.ppf(0.975, len(apart) - 1) * apart.std(ddof=1) / np.sqrt(len(apart))
    return float(apart.mean()), float(half)


def _exact_error(
    model: Model, reference: PointCloud, target: PointCloud, places: np.ndarray
) -> float:
    taught = model.set_reference(reference)
    encoded = model.encode(target)
    chosen = np.random.default_rng(0).permutation(len(reference))[:_COMPARED]
    surface = taught.map_surface(encoded)
    mapped = encoded.original(taught.map_points(chosen, encoded, surface).points)
    scale = float(np.ptp(target.points, axis=0).max())
    return float(np.linalg.norm(mapped - places[chosen], axis=1).mean() / scale)


def _doubt(model: Model, reference: PointCloud, target: PointCloud) -> float:
    one, two = model.set_reference(reference), model.set_reference(target)
    source, encoded = one.encoded_cloud, two.encoded_cloud
    there = one.map_surface(encoded).select(
        chosen := np.random.default_rng(0).permutation(len(source.points))[:_COMPARED]
    )
    off = encoded.distance(there.points, source.normals[chosen])
    moved_back = two.map_surface(source).points - encoded.points
    back = DisplacementInterpolator(encoded.points, there.points).interpolate(moved_back)
    away = np.linalg.norm(there.points + back - source.points[chosen], axis=1)
    return float((off + CYCLE_WEIGHT * away).mean())
