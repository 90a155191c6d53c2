"""Points and directions mapped from a reference's surface to a target's."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.normals import oriented_features
from nrdf.geometry.sampling import downsample
from nrdf.regions.reference import EncodedReference
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate
from nrdf.surface.surface import SAME_SIDE, Surface

FARTHEST, BEYOND, LEAST_TRUST = 0.06, 0.025, 0.3
"""A waypoint has a counterpart where C trusts the point that it gives, and where that point is at
most so far off the target's points: in all, and beyond an edge or in a hole. Shares of the longest
side, the distance between points not counted."""
_AROUND = 12  # points that decide whether a point is on the surface between them
_ANCHORS = 1200  # points of the reference whose positions are refined
_BLENDED, _BLEND = 8, 0.005  # anchors that a point follows, and the distance that softens it
_REGISTRATION = RegistrationSettings(
    iterations=8,
    radius_start=0.3,
    radius_end=0.15,
    normal_weight_start=0.15,
    normal_weight_end=0.1,
    match_scale=0.06,
)
"""Chosen on unseen family pairs (`nrdf eval warp`)."""


class ReferenceSurface:
    """A reference that waypoints are warped from: encoded, and as a surface."""

    def __init__(self, encoded: EncodedReference) -> None:
        self.encoded = encoded
        self.surface = surface_of(encoded.encoded_cloud)

    @cached_property
    def anchors(self) -> np.ndarray:
        """Evenly spread working points (a,) whose positions on a target are refined."""
        return downsample(self.encoded.encoded_cloud.points, _ANCHORS, np.random.default_rng(0))

    @cached_property
    def template(self) -> RegistrationTemplate:
        """The anchors, ready to be moved."""
        reference, at = self.encoded.encoded_cloud, self.anchors
        return RegistrationTemplate(reference.points[at], reference.normals[at], _REGISTRATION)

    @cached_property
    def tree(self) -> cKDTree:
        """The anchors in position and normal."""
        reference, at = self.encoded.encoded_cloud, self.anchors
        return cKDTree(
            oriented_features(reference.points[at], reference.normals[at], NORMAL_WEIGHT)
        )


class Correspondence:
    """The mapping from a reference's surface to a target's, both in metres.

    The model maps the reference as exactly as it can (`nrdf.regions.mapping`). A smooth, small
    displacement, as in registration, then brings the whole mapped reference closer to the target,
    so that edges come to lie on edges.
    """

    def __init__(self, reference: ReferenceSurface, target: EncodedCloud) -> None:
        self.reference, self.target = reference, target
        self.target_surface = surface_of(target)
        features = oriented_features(target.points, target.normals, NORMAL_WEIGHT)
        self._tree = cKDTree(features)

    @property
    def scale(self) -> float:
        """How much larger the target is than the reference, by their longest sides."""
        return self.target.pose.scale / self.reference.encoded.encoded_cloud.pose.scale

    @cached_property
    def _registered(self) -> np.ndarray:
        """Displacement (a, 3), canonical, that brings each mapped anchor onto the target."""
        reference, target = self.reference, self.target
        whole, anchors = reference.encoded.encoded_cloud, reference.anchors
        mapped = reference.encoded.map_surface_points(
            whole.original(whole.points[anchors]),
            whole.original_normals(whole.normals[anchors]),
            target,
        )
        start, facing = mapped.points, mapped.normals
        at = downsample(target.points, 2 * _ANCHORS, np.random.default_rng(1))
        moved = reference.template.register(target.points[at], target.normals[at], (start, facing))
        return np.asarray(moved.points - start)

    def map_points(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where points (m, 3) of the reference's surface, with normals (m, 3), are on the target.

        Returns points on its smooth surface (m, 3), normals there (m, 3), and whether the point
        has a counterpart (m,): the field trusts it, and it lies near the surface.
        """
        target, whole = self.target, self.reference.encoded.encoded_cloud
        mapped = self.reference.encoded.map_surface_points(points, normals, target)
        features = oriented_features(
            whole.canonical(points), whole.canonical_normals(normals), NORMAL_WEIGHT
        )
        distance, near = self.reference.tree.query(features, _BLENDED)
        weight = 1.0 / (distance + _BLEND) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        arrived = mapped.points + np.einsum("mk,mka->ma", weight, self._registered[near])
        nearest = self._tree.query(oriented_features(arrived, mapped.normals, NORMAL_WEIGHT))[1]
        start = target.original(target.points[nearest])
        outward = target.original_normals(target.normals[nearest])
        offset = target.original(arrived) - start
        sideways = offset - np.einsum("ma,ma->m", offset, outward)[:, None] * outward
        beyond = self._beyond(start, sideways, outward)
        kept = start + sideways * (1.0 - beyond / np.maximum(lengths(sideways), 1e-12))[:, None]
        found, found_normals = self.target_surface.project(kept, outward)
        size, spacing = target.pose.scale, self.target_surface.spacing
        exists = lengths(offset) <= FARTHEST * size + spacing
        exists &= beyond <= BEYOND * size + spacing
        return found, found_normals, exists & (mapped.trust >= LEAST_TRUST)

    def _beyond(self, start: np.ndarray, sideways: np.ndarray, outward: np.ndarray) -> np.ndarray:
        """How far (m,) points `start + sideways` (m, 3) lie off the edge of the target's cloud.

        A point with points of its side around and ahead of it is on the surface between them.
        """
        target, length = self.target_surface, lengths(sideways)
        near = np.arange(1, min(_AROUND, len(target.points)) + 1)
        distance, near = target.tree.query(start + sideways, near)
        alike = np.einsum("mka,ma->mk", target.normals[near], outward) > SAME_SIDE
        alike &= distance < 2.0 * target.spacing
        ahead = np.einsum(
            "mka,ma->mk", target.points[near] - start[:, None], unit_vectors(sideways)
        )
        reach = np.where(alike, ahead, 0.0).max(axis=1)
        return np.maximum(length - np.maximum(reach, 0.0), 0.0)

    def map_direction(self, region: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """A direction (3,) at a region of the reference, unit length, as it is on the target.

        region: (k,) indices into the reference's cloud. The smooth map between the two regions is
        taken as affine; across the surface, where points say nothing, as a rotation and a scale.
        """
        encoded = self.reference.encoded
        here = encoded.encoded_cloud.cloud.points[region]
        there = self.target.original(encoded.map_points(region, self.target).points)
        here, there = here - np.median(here, axis=0), there - np.median(there, axis=0)
        spread = here.T @ here
        size = float(np.trace(spread))
        if len(here) < 3 or size == 0.0:  # a spot has no orientation
            return self.turn_direction(direction)
        turn, _ = Rotation.align_vectors(there, here)
        similar = np.sqrt((there**2).sum() / size) * turn.as_matrix()
        ridge = 0.05 * size / 3.0 * np.eye(3)
        affine = np.linalg.solve(spread + ridge, here.T @ there + ridge @ similar.T).T
        return unit_vectors(affine @ unit_vectors(np.asarray(direction, float)))

    def turn_direction(self, direction: np.ndarray) -> np.ndarray:
        """A direction (3,) of the reference's frame, turned with the whole object only."""
        canonical = self.reference.encoded.encoded_cloud.canonical_normals(
            np.asarray(direction, float)
        )
        return unit_vectors(self.target.original_normals(canonical))

    def move_point(self, point: np.ndarray) -> np.ndarray:
        """A point (3,), m, of the reference's frame, moved, turned and scaled with the whole object
        only."""
        canonical = self.reference.encoded.encoded_cloud.canonical(np.asarray(point, float)[None])
        return self.target.original(canonical)[0]


def surface_of(encoded: EncodedCloud) -> Surface:
    """The surface of an encoded cloud, of its working points, in the cloud's own frame and unit."""
    return Surface(encoded.original(encoded.points), encoded.original_normals(encoded.normals))


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Lengths (m,) of vectors (m, 3)."""
    return np.linalg.norm(vectors, axis=1)
