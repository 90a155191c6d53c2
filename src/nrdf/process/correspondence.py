"""The way from a reference's surface to a target's: places on it, and directions."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud, oriented_features
from nrdf.geometry.sampling import downsample
from nrdf.geometry.similarity import LEFT_FOR_RIGHT, Similarity
from nrdf.io.cloud import PointCloud
from nrdf.regions.match import Mapped
from nrdf.regions.reference import EncodedReference
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate
from nrdf.surface.surface import SAME_SIDE, Surface, unit

FARTHEST, BEYOND, LEAST_TRUST = 0.06, 0.025, 0.3
"""A waypoint has a counterpart where C's place is at most so far off the target's points, in all,
and beyond an edge or in a hole, as shares of the longest side, not counting the distance between
points; and where C trusts it."""
_AROUND = 12  # points that tell whether a place is on the surface between them
_ANCHORS = 1200  # points of the reference whose places are settled
_BLENDED, _BLEND = 8, 0.005  # anchors that a place follows, and the distance that softens it
_SETTLING = RegistrationSettings(
    iterations=8,
    radius_start=0.3,
    radius_end=0.15,
    normal_weight_start=0.15,
    normal_weight_end=0.1,
    match_scale=0.06,
)
"""Chosen on unseen family pairs (`nrdf eval warp`)."""


class TaughtSurface:
    """A reference as waypoints are carried from it: as the field sees it, and as a surface."""

    def __init__(self, taught: EncodedReference) -> None:
        self.taught = taught
        self.surface = surface_of(taught.reference)

    @cached_property
    def mirrored(self) -> EncodedReference:
        """The reference's mirror image, left for right; its own frame is the canonical one."""
        return EncodedReference(
            self.taught.model, _mirrored(self.taught.model, self.taught.reference)
        )

    @cached_property
    def anchors(self) -> np.ndarray:
        """Even points (a,) of the working cloud whose places on a target are settled."""
        return downsample(self.taught.reference.points, _ANCHORS, np.random.default_rng(0))

    @cached_property
    def template(self) -> RegistrationTemplate:
        """The anchors, ready to be moved."""
        reference, at = self.taught.reference, self.anchors
        return RegistrationTemplate(reference.points[at], reference.normals[at], _SETTLING)

    @cached_property
    def tree(self) -> cKDTree:
        """The anchors in position and normal."""
        reference, at = self.taught.reference, self.anchors
        return cKDTree(
            oriented_features(reference.points[at], reference.normals[at], NORMAL_WEIGHT)
        )


class Correspondence:
    """The way from a reference's surface to a target's, both in metres.

    C is asked twice, the second time with both objects mirrored in z, which is an object of the
    category as well; the mean is better than either. Then its places are settled: a smooth, small
    displacement, as in registration, brings the whole mapped reference and the target closer, so
    that edges come to lie on edges.
    """

    def __init__(self, reference: TaughtSurface, embedded: EncodedCloud) -> None:
        self.reference, self.embedded = reference, embedded
        self.target = surface_of(embedded)
        features = oriented_features(embedded.points, embedded.normals, NORMAL_WEIGHT)
        self._tree = cKDTree(features)

    @cached_property
    def _mirrored(self) -> EncodedCloud:
        return _mirrored(self.reference.taught.model, self.embedded)

    def _mapped(self, points: np.ndarray, normals: np.ndarray) -> Mapped:
        """The mean of what C says of places (m, 3) of the reference and of their mirror images."""
        taught, reference = self.reference.taught, self.reference.taught.reference
        one = taught.map_places(points, normals, self.embedded)
        other = self.reference.mirrored.map_places(
            LEFT_FOR_RIGHT * reference.canonical(points),
            LEFT_FOR_RIGHT * reference.canonical_normals(normals),
            self._mirrored,
        )
        return one._replace(
            points=0.5 * (one.points + LEFT_FOR_RIGHT * other.points),
            normals=unit(unit(one.normals) + LEFT_FOR_RIGHT * unit(other.normals)),
            existence=0.5 * (one.existence + other.existence),
            error=0.5 * (one.error + other.error),
        )

    @cached_property
    def _settled(self) -> np.ndarray:
        """Displacement (a, 3) of each anchor's place, canonical."""
        reference, embedded = self.reference, self.embedded
        whole, anchors = reference.taught.reference, reference.anchors
        mapped = self._mapped(
            whole.original(whole.points[anchors]), whole.original_normals(whole.normals[anchors])
        )
        start, facing = mapped.points, mapped.normals
        at = downsample(embedded.points, 2 * _ANCHORS, np.random.default_rng(1))
        moved = reference.template.register(
            embedded.points[at], embedded.normals[at], (start, facing)
        )
        return np.asarray(moved.points - start)

    def places(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where places (m, 3) of the reference's surface, with normals (m, 3), are on the target.

        Returns places on its smooth surface (m, 3), normals there (m, 3), and whether the place
        exists (m,): the field trusts it, and it lies near the surface.
        """
        embedded, whole = self.embedded, self.reference.taught.reference
        mapped = self._mapped(points, normals)
        asked = oriented_features(
            whole.canonical(points), whole.canonical_normals(normals), NORMAL_WEIGHT
        )
        distance, near = self.reference.tree.query(asked, _BLENDED)
        weight = 1.0 / (distance + _BLEND) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        arrived = mapped.points + np.einsum("mk,mka->ma", weight, self._settled[near])
        nearest = self._tree.query(oriented_features(arrived, mapped.normals, NORMAL_WEIGHT))[1]
        start = embedded.original(embedded.points[nearest])
        outward = embedded.original_normals(embedded.normals[nearest])
        offset = embedded.original(arrived) - start
        sideways = offset - np.einsum("ma,ma->m", offset, outward)[:, None] * outward
        beyond = self._beyond(start, sideways, outward)
        kept = start + sideways * (1.0 - beyond / np.maximum(lengths(sideways), 1e-12))[:, None]
        found, found_normals = self.target.project(kept, outward)
        size, spacing = embedded.pose.scale, self.target.spacing
        exists = lengths(offset) <= FARTHEST * size + spacing
        exists &= beyond <= BEYOND * size + spacing
        return found, found_normals, exists & (mapped.trust >= LEAST_TRUST)

    def _beyond(self, start: np.ndarray, sideways: np.ndarray, outward: np.ndarray) -> np.ndarray:
        """How far (m,) places `start + sideways` (m, 3) lie off the edge of the target's points.

        A place with points of its side around and ahead of it is on the surface between them.
        """
        target, length = self.target, lengths(sideways)
        near = np.arange(1, min(_AROUND, len(target.points)) + 1)
        distance, near = target.tree.query(start + sideways, near)
        alike = np.einsum("mka,ma->mk", target.normals[near], outward) > SAME_SIDE
        alike &= distance < 2.0 * target.spacing
        ahead = np.einsum("mka,ma->mk", target.points[near] - start[:, None], unit(sideways))
        reach = np.where(alike, ahead, 0.0).max(axis=1)
        return np.maximum(length - np.maximum(reach, 0.0), 0.0)

    def direction(self, region: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """A direction (3,) at a region of the reference, unit length, as it is on the target.

        region: (k,) indices into the reference's cloud. The smooth map between the two regions is
        taken as affine; across the surface, where points do not tell, as a turn and a scale.
        """
        taught = self.reference.taught
        here = taught.reference.cloud.points[region]
        there = self.embedded.original(taught.map_points(region, self.embedded).points)
        here, there = here - np.median(here, axis=0), there - np.median(there, axis=0)
        spread = here.T @ here
        size = float(np.trace(spread))
        if len(here) < 3 or size == 0.0:  # a spot does not tell how it is turned
            canonical = taught.reference.canonical_normals(np.asarray(direction, float))
            return unit(self.embedded.original_normals(canonical))
        turn, _ = Rotation.align_vectors(there, here)
        similar = np.sqrt((there**2).sum() / size) * turn.as_matrix()
        ridge = 0.05 * size / 3.0 * np.eye(3)
        affine = np.linalg.solve(spread + ridge, here.T @ there + ridge @ similar.T).T
        return unit(affine @ unit(np.asarray(direction, float)))


def surface_of(embedded: EncodedCloud) -> Surface:
    """The surface of a cloud in metres, of the points that the field works on."""
    return Surface(embedded.original(embedded.points), embedded.original_normals(embedded.normals))


def _mirrored(model: CloudEncoder, embedded: EncodedCloud) -> EncodedCloud:
    """The mirror image of what the field works on, left for right, in the canonical frame."""
    image = PointCloud(LEFT_FOR_RIGHT * embedded.points, LEFT_FOR_RIGHT * embedded.normals)
    return model.encode(image, Similarity(np.eye(3), np.zeros(3), 1.0))


def lengths(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=1)
