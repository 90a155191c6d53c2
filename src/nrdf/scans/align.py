"""Bringing a scan into its category's frame: yaw, scale and centre, and what else it might be.

Yaws over the full circle are scored by the field (`nrdf.scans.pose_scorer`) and by a network that
tells which way an object faces (`nrdf.field.yaw_network`). The best are refined by the object's own
mirror plane (`nrdf.scans.mirror`) and scored again, front and back exchanged too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.field.yaw_network import log_probability_at
from nrdf.geometry.canonical import MIRROR, canonical_transform, rotation_about_up
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.geometry.similarity import AXES, Similarity, up_axis, upright
from nrdf.io.cloud import PointCloud, check_cloud
from nrdf.scans.mirror import MirrorPlane, mirror_plane
from nrdf.scans.pose_scorer import PoseScorer, sparse_subset

WORKING_POINTS = 8192
_COARSE_POINTS, _FINE_POINTS = 512, 1024  # that poses are scored with
_YAWS = 36  # that are tried at first
_REFINED = 4  # of them that are refined, by the field's score alone
_REFINED_WITH_YAW = 3, 2  # by the field's, and by the network's where there is one
_NUDGES = np.radians([-6.0, -3.0, 0.0, 3.0, 6.0])  # where there is no mirror plane
_APART = np.radians(25)  # poses whose rotations differ by less are one
_SYMMETRIC = 0.35  # agreement from which a mirror plane is believed
# Difference of cost that makes a pose e times less likely (without a network it is the scorer's).
# It, and what the network counts for, were chosen on 84 scans (half of them single views) of cars
# that the network was not trained on: no right pose is ambiguous.
_COST_SCALE_WITH_YAW = 0.1
_YAW_COST = 0.1  # of a yaw that is e times less likely than the likeliest, by the network
_LARGEST_YAW_COST = 3.0  # of those logarithms: the field can outweigh the network
SURE = 0.8
"""Probability of a pose against any other one alone, below which both are likely."""


@dataclass(frozen=True)
class Candidate:
    """One pose that may be the right one.

    pose: from canonical coordinates to the scan's. up: (3,) in the scan. yaw: (rad) about it.
    cost: how badly the field explains the scan in this pose (`field_cost`), and how unlikely
    the yaw is by the network of yaws. symmetry: share of the points that have a counterpart across
    the mirror plane, 0 where none was found. probability: of this pose among the candidates, which
    add up to 1.
    """

    pose: Similarity
    up: np.ndarray
    yaw: float
    cost: float
    symmetry: float
    probability: float = 1.0
    field_cost: float = 0.0


@dataclass(frozen=True)
class Alignment:
    """Poses of a scan, the likeliest first; seconds: time of each phase."""

    candidates: tuple[Candidate, ...]
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def best(self) -> Candidate:
        """The likeliest candidate."""
        return self.candidates[0]

    @property
    def likely(self) -> tuple[Candidate, ...]:
        """The candidates that explain the scan about as well as the best one, which is first."""
        least = (1 - SURE) / SURE * self.best.probability
        return tuple(c for c in self.candidates if c.probability >= least)

    @property
    def is_ambiguous(self) -> bool:
        """Whether there is more than one likely pose."""
        return len(self.likely) > 1


@dataclass(frozen=True)
class _Working:
    """The scan's working points, about 1 in size, and outward normals, (n, 3)."""

    points: np.ndarray
    normals: np.ndarray
    to_scan: Similarity


@dataclass(frozen=True)
class _Hypothesis:
    """canonical to working: rotation upright(up) @ rotation_about_up(yaw)."""

    up: np.ndarray
    yaw: float
    plane: MirrorPlane | None = None

    @property
    def rotation(self) -> np.ndarray:
        return upright(self.up) @ rotation_about_up(self.yaw)

    def frame(self, points: np.ndarray) -> Similarity:
        """Canonical to working by the bounding box of the points (n, 3), even about the plane."""
        turned = points @ self.rotation
        low, high = turned.min(axis=0), turned.max(axis=0)
        if self.plane is not None:
            half = max(high[2] - self.plane.offset, self.plane.offset - low[2])
            low[2], high[2] = self.plane.offset - half, self.plane.offset + half
        centre, scale = (low + high) / 2, float((high - low).max())
        return Similarity(self.rotation, self.rotation @ centre, scale)

    def reversed(self) -> _Hypothesis:
        """Front and back exchanged."""
        plane = self.plane
        if plane is not None:
            plane = MirrorPlane(-plane.normal, -plane.offset, plane.agreement)
        return _Hypothesis(self.up, self.yaw + np.pi, plane)


def align_scan(scorer: PoseScorer, scan: PointCloud, up: np.ndarray | None = None) -> Alignment:
    """Poses in which `scan`, a cleaned one of one object, is an object of the scorer's category.

    up: (3,) unit, in the scan's frame; the six axes are tried unless given. Raises CloudError for a
    cloud that is empty, flat, or has too few points.
    """
    check_cloud(scan, MINIMUM_POINTS)
    seconds: dict[str, float] = {}
    last = time.perf_counter()

    def lap(name: str) -> None:
        nonlocal last
        now = time.perf_counter()
        seconds[name], last = now - last, now

    working = _prepare(scan)
    lap("normals")
    ups = [up_axis(name) for name in AXES] if up is None else [up]
    yaws = 2 * np.pi / _YAWS * np.arange(_YAWS)
    tried = [_Hypothesis(axis, yaw) for axis in ups for yaw in yaws]
    chosen = sparse_subset(working.points, _COARSE_POINTS)
    costs: np.ndarray = scorer.coarse(*_posed(working, chosen, tried)).reshape(len(ups), _YAWS)
    lap("coarse")
    yaw_log_probability = _yaw_log_probability(scorer, working, ups)
    best = _minima(costs, _REFINED)
    if scorer.yaw is not None:
        yaw_costs = -np.array([log_probability_at(row, yaws) for row in yaw_log_probability])
        by_field, by_network = _REFINED_WITH_YAW
        best = np.unique([*best[:by_field], *_minima(yaw_costs, by_network)])
    lap("facing")
    refined = [found for index in best for found in _refine(working, tried[index])]
    lap("mirror")
    chosen = sparse_subset(working.points, _FINE_POINTS)
    points, normals = _posed(working, chosen, refined)
    field_costs = scorer.fine(points, normals, *_completed(points, normals, refined))
    costs = field_costs + _YAW_COST * _yaw_costs(yaw_log_probability, ups, refined)
    candidates: list[Candidate] = []
    for index in np.argsort(costs):
        found = refined[index]
        if all(_angle(found.rotation, other.pose.rotation) > _APART for other in candidates):
            pose = found.frame(working.points).then(working.to_scan)
            symmetry = found.plane.agreement if found.plane is not None else 0.0
            yaw = float(np.arctan2(np.sin(found.yaw), np.cos(found.yaw)))
            cost, alone = float(costs[index]), float(field_costs[index])
            candidates.append(Candidate(pose, found.up, yaw, cost, symmetry, field_cost=alone))
    lap("fine")
    scale = scorer.cost_scale if scorer.yaw is None else _COST_SCALE_WITH_YAW
    weights = np.exp((candidates[0].cost - np.array([c.cost for c in candidates])) / scale)
    weighed = zip(candidates, weights / weights.sum(), strict=True)
    return Alignment(tuple(replace(c, probability=float(w)) for c, w in weighed), seconds)


def _prepare(scan: PointCloud) -> _Working:
    kept = downsample(scan.points, WORKING_POINTS, np.random.default_rng(0))
    centre, scale = canonical_transform(scan.points[kept])
    to_scan = Similarity(np.eye(3), centre, scale)
    points = to_scan.to_canonical(scan.points[kept])
    if scan.normals is not None:
        return _Working(points, scan.normals[kept], to_scan)
    sensors = None if scan.sensors is None else to_scan.to_canonical(scan.sensors)
    return _Working(points, estimate_normals(points, sensors=sensors), to_scan)


def _posed(
    working: _Working, chosen: np.ndarray, hypotheses: list[_Hypothesis]
) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (h, n, 3) in each hypothesised canonical frame."""
    frames = [found.frame(working.points) for found in hypotheses]
    points = [frame.to_canonical(working.points[chosen]) for frame in frames]
    return np.array(points), np.array([working.normals[chosen] @ f.rotation for f in frames])


def _yaw_log_probability(
    scorer: PoseScorer, working: _Working, ups: list[np.ndarray]
) -> np.ndarray:
    """Log probabilities (ups, bins) of the yaws about each up; all equal without a network."""
    if scorer.yaw is None:
        return np.zeros((len(ups), _YAWS))
    order = np.random.default_rng(0).permutation(len(working.points))
    points, normals = working.points[order], working.normals[order]
    turns = [upright(up) for up in ups]
    return np.array([scorer.yaw.log_probability(points @ t, normals @ t) for t in turns])


def _yaw_costs(
    log_probability: np.ndarray, ups: list[np.ndarray], refined: list[_Hypothesis]
) -> np.ndarray:
    """The network's cost of each hypothesis (h,): how much less likely, in logarithms, up
    to what makes it sure."""
    numbers = [next(i for i, up in enumerate(ups) if up is found.up) for found in refined]
    likely = [
        log_probability_at(log_probability[i], found.yaw)
        for i, found in zip(numbers, refined, strict=True)
    ]
    return np.minimum(-np.array(likely), _LARGEST_YAW_COST)


def _refine(working: _Working, found: _Hypothesis) -> list[_Hypothesis]:
    """Hypotheses near one: both ways along the mirror plane, or a few yaws where there is none."""
    upright_axes = upright(found.up)
    plane = mirror_plane(
        working.points @ upright_axes,
        working.normals @ upright_axes,
        rotation_about_up(found.yaw)[:, 2],
    )
    if plane.agreement < _SYMMETRIC:
        return [_Hypothesis(found.up, found.yaw + nudge) for nudge in _NUDGES]
    yaw = float(np.arctan2(plane.normal[0], plane.normal[2]))
    exact = _Hypothesis(found.up, yaw, plane)
    return [exact, exact.reversed()]


def _completed(
    points: np.ndarray, normals: np.ndarray, hypotheses: list[_Hypothesis]
) -> tuple[np.ndarray, np.ndarray]:
    """Posed points and normals (h, n, 3), every second one reflected where there is a plane."""
    points, normals, half = points.copy(), normals.copy(), points.shape[1] // 2
    for index, found in enumerate(hypotheses):
        if found.plane is not None:
            points[index, 1::2] = points[index, ::2][:half] * MIRROR
            normals[index, 1::2] = normals[index, ::2][:half] * MIRROR
    return points, normals


def _minima(costs: np.ndarray, count: int) -> np.ndarray:
    """Flat indices of the lowest local minima of costs (ups, yaws) along the circle of yaws."""
    low = (costs <= np.roll(costs, 1, axis=1)) & (costs <= np.roll(costs, -1, axis=1))
    index = np.flatnonzero(low)
    return index[np.argsort(costs.ravel()[index], kind="stable")][:count]


def _angle(one: np.ndarray, two: np.ndarray) -> float:
    """Angle (rad) between two rotations."""
    return float(np.arccos(np.clip((np.trace(one.T @ two) - 1) / 2, -1, 1)))
