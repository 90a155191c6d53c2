"""Scores of hypothesised poses: how well known objects of the kind explain a cloud in each of them.

Prototypes, a few known objects, are registered to the cloud in each hypothesised pose. In the right
one they come to lie on it, on the right sides; in a wrong one they do not, or only by moving far.
What looks the same from two sides, such as a table, costs the same in both, and is reported as
ambiguous. Nothing is trained.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from nrdf.errors import ModelError
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import (
    NORMAL_WEIGHT,
    EncodedCloud,
    encoder_subset,
)
from nrdf.geometry.canonical import canonical_transform, rotation_about_up
from nrdf.geometry.normals import oriented_features
from nrdf.geometry.sampling import downsample
from nrdf.io.cloud import PointCloud
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate

# On pairs of labelled furniture: no wrong pose but of a round stool goes unreported, and one in
# ten right ones of chairs is ambiguous. Nine in ten pairs of a kind cost less than the usual
# cost and its margin; other furniture often does too, cars and aircraft do not.
COST_SCALE = 0.05
"""Difference of cost that makes a pose e times less likely."""
USUAL_COST = 1.1
"""The cost that is usual for an object of the kind in the right pose."""
COST_MARGIN = 0.9
"""The cost above the usual one from which a cloud does not look like one of the kind."""
LARGEST_Z_SCORE = 4.0
"""The z-score of proportions from which a cloud does not look like one of the kind."""
FIRST_SEED = 900_000  # of the members that serve as prototypes; no training set has them
PROTOTYPES = 8
_COARSE_POINTS, _FINE_POINTS = 256, 512  # of each prototype
_SCORED_POINTS = 1024  # of the cloud
_TOLERANCE = 0.08  # distance at which a point counts half as explained, canonical
_NEAR = 0.03  # added to the distance that a point's weight is inverse to
_MOVED = 5.0  # cost of moving by a canonical length
_SETTINGS = RegistrationSettings(iterations=8)
_OTHER_YAWS = np.pi / 2 * np.arange(1, 4)
_OTHER_UPS = [turn for turn in Rotation.create_group("O").as_matrix() if turn[1, 1] < 0.5]
_LIKELY_UPS = 3  # orientations that are looked at closely
_MUCH = 0.15  # difference of cost from which another yaw is much better
_BEST = 2  # prototypes that are most like the cloud, by which it is judged
_LEAST_SPREAD = 0.15  # of the logarithm of proportions


class _Scored(NamedTuple):
    """A target, some of its points and normals (n, 3), and their cost as they are."""

    target: EncodedCloud
    points: np.ndarray
    normals: np.ndarray
    cost: float


class PoseScorer:
    """Scores poses of clouds by prototypes. A score is a cost: the lower, the better the prototypes
    explain the cloud.

    model: what encodes clouds.
    """

    def __init__(self, model: CloudEncoder, prototypes: Sequence[PointCloud] = ()) -> None:
        """`prototypes` are canonical in orientation; members of the category's family unless given.

        Raises ModelError if there are none and the category has no family.
        """
        given = list(prototypes) or family_prototypes(model.category)
        self.model = model
        self.prototypes = len(given)
        self._clouds = [model.encode(cloud) for cloud in given]
        self._latest: _Scored | None = None
        self._templates = []
        for cloud in self._clouds:
            chosen = even_subset(cloud.points, _FINE_POINTS)
            self._templates.append(
                RegistrationTemplate(cloud.points[chosen], cloud.normals[chosen], _SETTINGS)
            )

    @property
    def name(self) -> str:
        """What the objects are, such as "chair"."""
        return self.model.category or "known object"

    def coarse(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Cost (h,) of h hypotheses, fast: clouds (h, n, 3) in hypothesised canonical frames. How
        far the prototypes are from the cloud, brought into its box."""
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

    def fine(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Cost (h,) as of `coarse`, more exactly: how far registration leaves the prototypes from
        clouds (h, m, 3), completed by their mirror images where they have one, and how far it moves
        them."""
        return np.array([self._cost(*pair) for pair in zip(points, normals, strict=True)])

    def twist(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """By how much h clouds (h, m, 3) in hypothesised canonical frames are turned about +Y away
        from the prototypes, (h,), rad: of the rotations that registration contains (Procrustes
        about one axis, points that it leaves near the cloud counting most) the median. Registration
        bends to a heading that is 20° off, so its cost hardly tells; the rotation does."""
        return np.array([self._twist(*pair) for pair in zip(points, normals, strict=True)])

    def _twist(self, points: np.ndarray, normals: np.ndarray) -> float:
        angles = []
        for template in self._templates:
            found = template.register(points, normals)
            weight = 1.0 / (found.distance**2 + _NEAR**2)
            own, there = (
                (values - np.average(values, axis=0, weights=weight))[:, [2, 0]]
                for values in (template.points, found.points)
            )
            along = (weight * (own * there).sum(axis=1)).sum()
            across = (weight * (own[:, 0] * there[:, 1] - own[:, 1] * there[:, 0])).sum()
            angles.append(np.arctan2(across, along))
        return float(np.median(angles))

    def cost_of(self, target: EncodedCloud) -> float:
        """The cost of a target in the pose in which it is encoded."""
        return self._scored(target).cost

    def better_turn(self, target: EncodedCloud) -> np.ndarray | None:
        """The rotation (3, 3), points @ rotation, in which the target looks much more like one of
        the kind than in the pose in which it is encoded; None where there is none. Of the quarter
        turns about +Y, and, where the cost is not usual, of those that make other sides the upper
        one."""
        _, points, normals, as_given = self._scored(target)
        if as_given <= _MUCH:
            return None
        turns = [rotation_about_up(yaw) for yaw in _OTHER_YAWS]
        if as_given > USUAL_COST:
            few = slice(0, 2 * _COARSE_POINTS)
            posed = [_turned(points[few], normals[few], turn) for turn in _OTHER_UPS]
            costs = self.coarse(*(np.array(values) for values in zip(*posed, strict=True)))
            turns += [_OTHER_UPS[n] for n in np.argsort(costs)[:_LIKELY_UPS]]
        costs = np.array([self._cost(*_turned(points, normals, turn)) for turn in turns])
        best = int(np.argmin(costs))
        if costs[best] >= as_given - _MUCH:
            return None
        # An object of another kind fits a little better on its side, but never as is usual.
        return turns[best] if turns[best][1, 1] > 0.5 or costs[best] < USUAL_COST else None

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
        return float(np.sort(costs)[:_BEST].mean())

    def proportion_z_score(self, points: np.ndarray) -> float:
        """Z-score of the proportions of a canonical cloud (n, 3): standard deviations from the
        prototypes' mean (root mean square over the axes)."""
        known = np.array([_proportions(cloud.points) for cloud in self._clouds])
        spread = np.maximum(known.std(axis=0), _LEAST_SPREAD)
        return float(np.sqrt(np.mean(((_proportions(points) - known.mean(axis=0)) / spread) ** 2)))


def family_prototypes(category: str) -> list[PointCloud]:
    """Members of a category's family that no training set holds. Raises ModelError without one."""
    from nrdf.shapes.families import FAMILY_NAMES, get_family  # slow to import, seldom needed

    if category not in FAMILY_NAMES:
        raise ModelError(
            f"the category '{category}' has no parametric family (there are "
            f"{', '.join(FAMILY_NAMES)}), so alignment needs an example: give a --reference"
            if category
            else "a model for any category knows no objects: alignment needs an example: give a "
            "--reference, +X forward and +Y up"
        )
    family = get_family(category)
    rng = np.random.default_rng(0)
    found = []
    for seed in range(FIRST_SEED, FIRST_SEED + PROTOTYPES):
        surface = family.member(seed).sample_surface(2048, rng)
        found.append(PointCloud(surface.points, surface.normals))
    return found


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


def _turned(
    points: np.ndarray, normals: np.ndarray, turn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (n, 3) in another orientation, canonical again."""
    turned = points @ turn
    centre, scale = canonical_transform(turned)
    return (turned - centre) / scale, normals @ turn


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
