"""Surfaces mapped by a trained field: descriptors θ, and the inverse C that finds their points."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import torch

from nrdf.field.base import Inverse
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.geometry.canonical import MIRROR
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf.regions.mapping import MappedPoints
from nrdf.regions.presence import FIELD_RULE, PresenceRule

_CHUNK = 8192  # points described or inverted at a time


class FieldMapper:
    """Maps a source's surface by C of its descriptors (paper, eq. 8), which are kept."""

    presence_rule: PresenceRule = FIELD_RULE

    def __init__(self, model: CloudEncoder, source: EncodedCloud) -> None:
        self.model, self.source = model, source
        self._k = describe(model, source.z, source.points, source.normals)
        self._latest: tuple[EncodedCloud, EncodedCloud] | None = None

    def map_working(self, target: EncodedCloud, chosen: np.ndarray | None = None) -> MappedPoints:
        """As of `SurfaceMapper`: C(z_target, k)."""
        k, normals = self._k, self.source.normals
        if chosen is not None:
            k, normals = k[:, chosen], normals[chosen]
        return invert(self.model, target.z, k, normals)

    def map_points(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """As of `SurfaceMapper`: C(z_target, θ(z_source, x))."""
        k = describe(self.model, self.source.z, points, normals)
        return invert(self.model, target.z, k, normals)

    def map_precisely(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """As of `SurfaceMapper`: the mean of where C puts points and their mirror images, both
        shapes being mirrored, which gives shapes of the category as well."""
        one = self.map_points(points, normals, target)
        other = self._mirrored.map_points(
            MIRROR * points, MIRROR * normals, self._mirror_image(target)
        )
        return one._replace(
            points=0.5 * (one.points + MIRROR * other.points),
            normals=unit_vectors(unit_vectors(one.normals) + MIRROR * unit_vectors(other.normals)),
            existence=0.5 * (one.existence + other.existence),
            error=0.5 * (one.error + other.error),
        )

    def map_back(self, target: EncodedCloud, chosen: np.ndarray | slice) -> MappedPoints:
        """As of `SurfaceMapper`: C(z_source, θ(z_target, x))."""
        points, normals = target.points[chosen], target.normals[chosen]
        k = describe(self.model, target.z, points, normals)
        return invert(self.model, self.source.z, k, normals)

    @cached_property
    def _mirrored(self) -> FieldMapper:
        return FieldMapper(self.model, self._mirrored_cloud(self.source))

    def _mirror_image(self, target: EncodedCloud) -> EncodedCloud:
        """The mirror image of a target; that of the latest one is kept."""
        latest = self._latest
        if latest is None or latest[0] is not target:
            latest = self._latest = target, self._mirrored_cloud(target)
        return latest[1]

    def _mirrored_cloud(self, encoded: EncodedCloud) -> EncodedCloud:
        """The mirror image of an encoded cloud, left for right, in the canonical frame."""
        image = PointCloud(MIRROR * encoded.points, MIRROR * encoded.normals)
        return self.model.encode(image, Similarity(np.eye(3), np.zeros(3), 1.0))


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
