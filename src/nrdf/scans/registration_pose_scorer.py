"""Scores of hypothesised poses by registration: where nothing is trained, an object is known.

A prototype is registered to the cloud in each pose. Small registrations tell: in a wrong pose the
prototype does not come to lie on the cloud, or only by moving far. What looks the same from two
sides, such as a table, costs the same in both, and is reported as ambiguous.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ModelError
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import NORMAL_WEIGHT, EncodedCloud, oriented_features
from nrdf.geometry.canonical import canonical_transform, rotation_about_up
from nrdf.io.cloud import PointCloud
from nrdf.scans.pose_scorer import PoseScorer, even_subset, sparse_subset
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate

_COARSE_POINTS, _FINE_POINTS = 256, 512  # of each prototype
_SCORED_POINTS = 1024  # of the cloud
_TOLERANCE = 0.08  # distance at which a point counts half as explained, canonical
_MOVED = 5.0  # cost of moving by a canonical length
_SETTINGS = RegistrationSettings(iterations=8)
_OTHER_YAWS = np.pi / 2 * np.arange(1, 4)
_MUCH = 0.15  # difference of cost from which another yaw is much better


class _Scored(NamedTuple):
    """A target, some of its points and normals (n, 3), and their cost as they are."""

    target: EncodedCloud
    points: np.ndarray
    normals: np.ndarray
    cost: float


class RegistrationPoseScorer(PoseScorer):
    """Scores poses by registering prototypes, which are needed; see `PoseScorer`."""

    # On pairs of labelled furniture: no wrong pose but of a round stool goes unreported, and one in
    # ten right ones of chairs is ambiguous. Nine in ten pairs of a kind cost less than the usual
    # cost and its margin; other furniture often does too, cars and aircraft do not.
    cost_scale: ClassVar[float] = 0.05
    usual_cost: ClassVar[float] = 1.1  # type: ignore[misc]
    cost_margin: ClassVar[float] = 0.9  # type: ignore[misc]

    largest_z_score: ClassVar[float] = 4.0  # type: ignore[misc]

    def __init__(self, model: CloudEncoder, prototypes: Sequence[PointCloud]) -> None:
        """`prototypes` are canonical in orientation. Raises ModelError if there are none."""
        if not prototypes:
            raise ModelError(
                "the model registration knows no objects to align by: give an example of the kind, "
                "+X forward and +Y up (--reference)"
            )
        super().__init__(model, prototypes, None)
        self._latest: _Scored | None = None
        self._templates = []
        for cloud in self._clouds:
            chosen = even_subset(cloud.points, _FINE_POINTS)
            self._templates.append(
                RegistrationTemplate(cloud.points[chosen], cloud.normals[chosen], _SETTINGS)
            )

    def coarse(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """As of `PoseScorer`: how far the prototype is from the cloud, brought into its box."""
        costs = np.zeros(len(points))
        for template in self._templates:
            own, sides = template.points[:_COARSE_POINTS], template.normals[:_COARSE_POINTS]
            low, high = own.min(axis=0), own.max(axis=0)
            share = (own - low) / np.maximum(high - low, 1e-6)
            for number, (cloud, its) in enumerate(zip(points, normals, strict=True)):
                lowest, highest = cloud.min(axis=0), cloud.max(axis=0)
                moved = 0.5 * own + 0.5 * (share * (highest - lowest) + lowest)
                there, back = _distances(moved, sides, cloud, its)
                change = np.linalg.norm(moved - own, axis=1).mean()
                costs[number] += _unexplained(there) + _unexplained(back) + _MOVED * change
        return costs / self.prototypes

    def fine(
        self, points: np.ndarray, normals: np.ndarray, whole: np.ndarray, whole_normals: np.ndarray
    ) -> np.ndarray:
        """As of `PoseScorer`: also how far registration moves the prototype."""
        return np.array([self._cost(*pair) for pair in zip(whole, whole_normals, strict=True)])

    def cost_of(self, target: EncodedCloud) -> float:
        """As of `PoseScorer`."""
        return self._scored(target).cost

    def better_yaw(self, target: EncodedCloud) -> float | None:
        """As of `PoseScorer`: of the quarter turns."""
        _, points, normals, as_given = self._scored(target)
        if as_given <= _MUCH:
            return None
        costs = []
        for yaw in _OTHER_YAWS:
            turn = rotation_about_up(yaw)
            turned = points @ turn
            centre, scale = canonical_transform(turned)
            costs.append(self._cost((turned - centre) / scale, normals @ turn))
        best = int(np.argmin(costs))
        return float(_OTHER_YAWS[best]) if costs[best] < as_given - _MUCH else None

    def _scored(self, target: EncodedCloud) -> _Scored:
        """The points of a target that tell, and its cost; those of the latest are kept."""
        latest = self._latest
        if latest is None or latest.target is not target:
            chosen = sparse_subset(target.points, _SCORED_POINTS)
            points, normals = target.points[chosen], target.normals[chosen]
            latest = self._latest = _Scored(target, points, normals, self._cost(points, normals))
        return latest

    def _cost(self, points: np.ndarray, normals: np.ndarray) -> float:
        costs = []
        for template in self._templates:
            found = template.register(points, normals)
            change = np.linalg.norm(found.points - template.points, axis=1).mean()
            unexplained = _unexplained(found.distance) + _unexplained(found.back)
            costs.append(unexplained + _MOVED * float(change))
        return float(np.mean(costs))


def _distances(
    one: np.ndarray, one_normals: np.ndarray, two: np.ndarray, two_normals: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (n,) and (m,) in position and weighted normal between two clouds, both ways."""
    first = oriented_features(one, one_normals, NORMAL_WEIGHT)
    second = oriented_features(two, two_normals, NORMAL_WEIGHT)
    return cKDTree(second).query(first)[0], cKDTree(first).query(second)[0]


def _unexplained(distance: np.ndarray) -> float:
    """Mean robust distance (Geman and McClure), 0 to 1."""
    square = distance**2
    return float(np.mean(square / (square + _TOLERANCE**2)))
