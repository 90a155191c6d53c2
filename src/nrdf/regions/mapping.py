"""Points of one shape mapped onto another: descriptors θ, and the inverse C that finds them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch

from nrdf.field.base import Inverse
from nrdf.field.cloud_encoder import CloudEncoder

TRUST_SCALE = 0.2
"""Canonical distance at which trust has fallen to 1/e: between a target point and the mapped
reference, and for the error that the field expects of its prediction."""
_CHUNK = 8192  # points described or inverted at a time


class MappedPoints(NamedTuple):
    """Reference points mapped onto a target, canonical.

    points, normals: (m, 3). existence: (m,) in [0, 1], whether the target has such a point; error:
    (m,) that the field expects of its prediction; 1 and 0 for a field that does not predict them.
    displacement: (m, 3), how far refinement has moved the points.
    """

    points: np.ndarray
    normals: np.ndarray
    existence: np.ndarray
    error: np.ndarray
    displacement: np.ndarray

    def displaced(self, by: np.ndarray) -> MappedPoints:
        """The same, moved by (m, 3)."""
        return self._replace(points=self.points + by, displacement=self.displacement + by)

    @property
    def trust(self) -> np.ndarray:
        """(m,) in [0, 1]: that the point exists, and how small an error is expected."""
        return self.existence * np.exp(-self.error / TRUST_SCALE)

    def select(self, chosen: np.ndarray) -> MappedPoints:
        """The points at `chosen`, integers (k,) or a mask (m,)."""
        return MappedPoints(*(values[chosen] for values in self))


def describe(
    model: CloudEncoder, z: torch.Tensor, points: np.ndarray, normals: np.ndarray
) -> torch.Tensor:
    """Descriptors (1, m, d_k) of canonical points and normals (m, 3) on the shape of z (1, d_z)."""
    parts = []
    with torch.inference_mode():
        for start in range(0, len(points), _CHUNK):
            part = slice(start, start + _CHUNK)
            p, n = model.tensor(points[part])[None], model.tensor(normals[part])[None]
            parts.append(model.field.describe(z, p, n))
    return torch.cat(parts, dim=1)


def invert(
    model: CloudEncoder, z: torch.Tensor, k: torch.Tensor, normals: np.ndarray
) -> MappedPoints:
    """The points on the shape of z (1, d_z) that descriptors k (1, m, d_k) belong to: C(z, k).

    normals: (m, 3) of the points that were described, for a field that predicts none. Raises
    ModelError for a field without an inverse.
    """
    parts = []
    with torch.inference_mode():
        for start in range(0, k.shape[1], _CHUNK):
            part = slice(start, start + _CHUNK)
            parts.append(_to_arrays(model.field.invert(z, k[:, part]), normals[part]))
    return MappedPoints(*map(np.concatenate, zip(*parts, strict=True)))


def _to_arrays(inverse: Inverse, normals: np.ndarray) -> MappedPoints:
    """One target's prediction; what the field does not predict: the `normals` (m, 3) that the
    points had where they were described, certain existence, no error."""
    count = len(normals)
    return MappedPoints(
        inverse.points[0].cpu().numpy(),
        normals if inverse.normals is None else inverse.normals[0].cpu().numpy(),
        np.ones(count, np.float32)
        if inverse.existence is None
        else inverse.existence[0].sigmoid().cpu().numpy(),
        np.zeros(count, np.float32)
        if inverse.log_error is None
        else inverse.log_error[0].exp().cpu().numpy(),
        np.zeros((count, 3), np.float32),
    )
