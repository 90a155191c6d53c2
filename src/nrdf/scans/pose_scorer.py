"""Scores of hypothesised poses: the interface, whatever scores them.

Prototypes, a few known objects of the kind, are mapped onto the cloud in each hypothesised pose. In
the right one they come to lie on it, on the right sides; in a wrong one they do not, or only by
moving far.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import EncodedCloud, encoder_subset
from nrdf.field.yaw_network import YawNetwork
from nrdf.geometry.sampling import downsample
from nrdf.io.cloud import PointCloud

_LEAST_SPREAD = 0.15  # of the logarithm of proportions


class PoseScorer(ABC):
    """Scores poses of clouds by prototypes. A score is a cost: the lower, the better the prototypes
    explain the cloud.

    model: what encodes clouds; yaw: estimates which way an object faces, None without a network.
    """

    cost_scale: ClassVar[float]
    """Difference of cost that makes a pose e times less likely, where there is no network."""

    def __init__(
        self, model: CloudEncoder, prototypes: Sequence[PointCloud], yaw: YawNetwork | None
    ) -> None:
        self.model, self.yaw = model, yaw
        self.prototypes = len(prototypes)
        self._clouds = [model.encode(cloud) for cloud in prototypes]

    @property
    def name(self) -> str:
        """What the objects are, such as "chair"."""
        return self.model.category or "known object"

    @property
    @abstractmethod
    def usual_cost(self) -> float:
        """The cost that is usual for an object of the kind in the right pose."""

    @property
    @abstractmethod
    def cost_margin(self) -> float:
        """The cost above the usual one from which a cloud does not look like one of the kind."""

    @property
    @abstractmethod
    def largest_z_score(self) -> float:
        """The z-score of proportions from which a cloud does not look like one of the kind."""

    @abstractmethod
    def coarse(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Cost (h,) of h hypotheses, fast: clouds (h, n, 3) in hypothesised canonical frames."""

    @abstractmethod
    def fine(
        self, points: np.ndarray, normals: np.ndarray, whole: np.ndarray, whole_normals: np.ndarray
    ) -> np.ndarray:
        """Cost (h,) as of `coarse`, more exactly. whole, whole_normals: (h, m, 3) the cloud,
        completed by its mirror image where it has one."""

    @abstractmethod
    def cost_of(self, target: EncodedCloud) -> float:
        """The cost of a target in the pose in which it is encoded."""

    def better_yaw(self, target: EncodedCloud) -> float | None:
        """The yaw (rad) about which the target looks much more like one of the kind than in the
        pose in which it is encoded; None where there is none, or nothing tells."""
        return None

    def proportion_z_score(self, points: np.ndarray) -> float:
        """Z-score of the proportions of a canonical cloud (n, 3): standard deviations from the
        prototypes' mean (root mean square over the axes)."""
        known = np.array([_proportions(cloud.points) for cloud in self._clouds])
        spread = np.maximum(known.std(axis=0), _LEAST_SPREAD)
        return float(np.sqrt(np.mean(((_proportions(points) - known.mean(axis=0)) / spread) ** 2)))


def sparse_subset(points: np.ndarray, count: int) -> np.ndarray:
    """Indices (at most `count`,) of points that stand for all, the extreme ones included as far as
    they fit, in random order."""
    return np.random.default_rng(0).permutation(encoder_subset(points, count))[:count]


def even_subset(points: np.ndarray, count: int) -> np.ndarray:
    """Indices (at most `count`,) of evenly spread points, in random order."""
    chosen = downsample(points, count, np.random.default_rng(0))
    return np.random.default_rng(0).permutation(chosen)


def _proportions(points: np.ndarray) -> np.ndarray:
    """Logarithms (3,) of the bounding box's sides, their mean taken off."""
    sides = np.log(np.maximum(np.ptp(points, axis=0), 1e-3))
    return sides - sides.mean()
