"""A cloud as a field sees it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import torch
from scipy.spatial import cKDTree

from nrdf.geometry.local_shape import local_shapes, telling_directions
from nrdf.geometry.normals import oriented_features, oriented_tree
from nrdf.geometry.sampling import downsample, indices_in_subset
from nrdf.geometry.similarity import Similarity
from nrdf.geometry.visibility import seen_from_both_sides
from nrdf.io.cloud import PointCloud

NORMAL_WEIGHT = 0.1
"""Canonical length that one unit of normal difference counts for: tells thin sides apart."""


@dataclass(frozen=True)
class EncodedCloud:
    """A cloud as the field sees it: thinned, with normals, canonical, with its embedding z.

    cloud: what the user gave. working: (n,) indices of its points in use; one that stands for both
    sides of a sheet is there twice. points, normals: (n, 3) canonical. pose: from canonical
    coordinates to the cloud's. z: (1, d_z). seconds: time of each phase.
    """

    cloud: PointCloud
    working: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    pose: Similarity
    z: torch.Tensor
    seconds: dict[str, float] = field(default_factory=dict)

    def original(self, points_canonical: np.ndarray) -> np.ndarray:
        """Canonical points (m, 3) in the cloud's own frame and unit."""
        return self.pose.to_scan(np.asarray(points_canonical, np.float64))

    def canonical(self, points: np.ndarray) -> np.ndarray:
        """Points (m, 3) of the cloud's own frame and unit in canonical coordinates."""
        return self.pose.to_canonical(points)

    def original_normals(self, normals_canonical: np.ndarray) -> np.ndarray:
        """Canonical directions (m, 3) in the cloud's own frame."""
        return normals_canonical @ self.pose.rotation.T

    def canonical_normals(self, normals: np.ndarray) -> np.ndarray:
        """Directions (m, 3) of the cloud's own frame in the canonical one."""
        return normals @ self.pose.rotation

    def to_working(self, indices: np.ndarray) -> np.ndarray:
        """A region given by `indices` (m,) into `cloud.points`, as indices (k,), ascending, of the
        working points."""
        return indices_in_subset(self.working, indices, len(self.cloud.points))

    def to_all(self, selected: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Selected working points as indices of the whole cloud, and which working point each
        follows (its nearest): (k,) indices into `cloud.points`, (k,) positions in `working`.
        """
        position = np.full(len(self.cloud.points), -1)
        position[self.working[selected]] = np.flatnonzero(selected)
        follows = position[self.working[self.nearest_working]]
        index = np.flatnonzero(follows >= 0)
        return index, follows[index]

    def two_sided(self) -> EncodedCloud:
        """The same, points of sheets whose side nothing tells standing for both of their sides.

        Of a cloud that is open, without normals and without sensors: what was not seen in front of
        a sheet makes its back as likely as its front. The embedding stays.
        """
        if self.cloud.normals is not None or self.cloud.sensors is not None:
            return self
        again = np.flatnonzero(seen_from_both_sides(self.points, self.normals))
        return replace(
            self,
            working=np.concatenate([self.working, self.working[again]]),
            points=np.concatenate([self.points, self.points[again]]),
            normals=np.concatenate([self.normals, -self.normals[again]]),
        )

    @property
    def is_whole(self) -> bool:
        """Whether every point of the cloud is in use."""
        return np.array_equal(self.working, np.arange(len(self.cloud.points)))

    @cached_property
    def nearest_working(self) -> np.ndarray:
        """The position in `working` of the point nearest to each point of the cloud."""
        if self.is_whole:
            return self.working
        return cKDTree(self.points).query(self.canonical(self.cloud.points))[1]

    def distance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Distance (m,) of canonical points and normals (m, 3) from the working points, in position
        and weighted normal."""
        features = oriented_features(points, normals, NORMAL_WEIGHT)
        return self._oriented_tree.query(features)[0]

    def nearest(self, points: np.ndarray, normals: np.ndarray, count: int) -> np.ndarray:
        """The `count` working points (m, count) that are nearest to canonical points and normals
        (m, 3), in position and weighted normal."""
        features = oriented_features(points, normals, NORMAL_WEIGHT)
        wanted = np.arange(1, min(count, len(self.points)) + 1)
        return np.asarray(self._oriented_tree.query(features, k=wanted)[1])

    @cached_property
    def local_shapes(self) -> np.ndarray:
        """How the surface lies around the working points, (n, 12) (`nrdf.geometry.local_shape`)."""
        return local_shapes(self.points, self.normals)

    def alike_features(self, other: EncodedCloud) -> tuple[np.ndarray, np.ndarray]:
        """What tells which points of another cloud lie as those of this one do: features (n, 3) of
        the working points and (m, 3) of the other's, whose distances are those of local shapes, as
        far as this cloud's own differ."""
        directions = self._telling_directions
        return self.local_shapes @ directions, other.local_shapes @ directions

    @cached_property
    def _telling_directions(self) -> np.ndarray:
        return telling_directions(self.local_shapes)

    @cached_property
    def _oriented_tree(self) -> cKDTree:
        return oriented_tree(self.points, self.normals, NORMAL_WEIGHT)

    @cached_property
    def tree(self) -> cKDTree:
        """The cloud's own points, for regions that are given as points."""
        return cKDTree(self.cloud.points)


def encoder_subset(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of the points that the encoder sees: an even subset of `count`, which always holds
    the extreme points of each axis, so that the embedding knows the bounding box exactly."""
    chosen = downsample(points, count, np.random.default_rng(0))
    extremes = np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])
    return np.union1d(chosen, extremes)
