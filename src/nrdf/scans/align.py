"""Bringing a scan into its category's frame: yaw, scale and centre, and what else it might be.

Yaws over the full circle are scored by known objects of the kind (`nrdf.scans.pose_scorer`). The
best are refined by the object's own mirror plane (`nrdf.scans.mirror`) and scored again, front and
back exchanged too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.geometry.canonical import MIRROR, canonical_transform, rotation_about_up
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.geometry.similarity import AXES, Similarity, up_axis, upright
from nrdf.io.cloud import PointCloud, check_cloud
from nrdf.scans.mirror import MirrorPlane, mirror_plane
from nrdf.scans.pose_scorer import COST_SCALE, PoseScorer, sparse_subset

WORKING_POINTS = 8192
_COARSE_POINTS, _FINE_POINTS = 512, 1024  # that poses are scored with
_YAWS = 36  # that are tried at first
_REFINED = 4  # of them that are refined
_ASKEW = np.radians(8)  # from all axes, from which a direction is tried beside them
_ASKEW_COST = 0.1  # of such a direction: most scans stand along an axis
_TWISTS = 4  # times that a yaw is corrected where there is no mirror plane
_APART = np.radians(25)  # poses whose rotations differ by less are one
_SYMMETRIC = 0.35  # agreement from which a mirror plane is believed
SURE = 0.8
"""Probability of a pose against any other one alone, below which both are likely."""


@dataclass(frozen=True)
class Candidate:
    """One pose that may be the right one.

    pose: from canonical coordinates to the scan's. up: (3,) in the scan. yaw: (rad) about it.
    cost: how badly the known objects explain the scan in this pose. symmetry: share of the points
    that have a counterpart across the mirror plane, 0 where none was found. probability: of this
    pose among the candidates, which add up to 1.
    """

    pose: Similarity
    up: np.ndarray
    yaw: float
    cost: float
    symmetry: float
    probability: float = 1.0


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

    up: (3,) unit, in the scan's frame; the six axes and the sides of the smallest box around it are
    tried unless given. Raises CloudError for a
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
    ups = _likely_ups(working.points) if up is None else [up]
    yaws = 2 * np.pi / _YAWS * np.arange(_YAWS)
    tried = [_Hypothesis(axis, yaw) for axis in ups for yaw in yaws]
    chosen = sparse_subset(working.points, _COARSE_POINTS)
    costs: np.ndarray = scorer.coarse(*_posed(working, chosen, tried)).reshape(len(ups), _YAWS)
    lap("coarse")
    best = [tried[index] for index in _minima(costs, _REFINED)]
    refined = [found for one in best for found in _refine(scorer, working, chosen, one)]
    lap("mirror")
    chosen = sparse_subset(working.points, _FINE_POINTS)
    points, normals = _posed(working, chosen, refined)
    costs = scorer.fine(*_completed(points, normals, refined))
    if up is None:
        costs += [_ASKEW_COST * bool(np.abs(found.up).max() < np.cos(_ASKEW)) for found in refined]
    candidates: list[Candidate] = []
    for index in np.argsort(costs):
        found = refined[index]
        if all(_angle(found.rotation, other.pose.rotation) > _APART for other in candidates):
            pose = found.frame(working.points).then(working.to_scan)
            symmetry = found.plane.agreement if found.plane is not None else 0.0
            yaw = float(np.arctan2(np.sin(found.yaw), np.cos(found.yaw)))
            candidates.append(Candidate(pose, found.up, yaw, float(costs[index]), symmetry))
    lap("fine")
    weights = np.exp((candidates[0].cost - np.array([c.cost for c in candidates])) / COST_SCALE)
    weighed = zip(candidates, weights / weights.sum(), strict=True)
    return Alignment(tuple(replace(c, probability=float(w)) for c, w in weighed), seconds)


def _likely_ups(points: np.ndarray) -> list[np.ndarray]:
    """Directions (3,) in which points (n, 3) may have their upper side: the six axes, and, where
    the smallest box around them stands askew, the six directions of its sides."""
    from trimesh import bounds  # slow to import, and what stands upright never comes here

    ups = [up_axis(name) for name in AXES]
    sides = bounds.oriented_bounds(points)[0][:3, :3]
    askew = [side for side in (*sides, *-sides) if np.abs(side).max() < np.cos(_ASKEW)]
    return [*ups, *askew]


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


def _refine(
    scorer: PoseScorer, working: _Working, chosen: np.ndarray, found: _Hypothesis
) -> list[_Hypothesis]:
    """Hypotheses near one: both ways along the mirror plane, or, where there is none, the yaw in
    which the known objects are not turned away from the cloud."""
    for twists in range(_TWISTS + 1):
        upright_axes = upright(found.up)
        plane = mirror_plane(
            working.points @ upright_axes,
            working.normals @ upright_axes,
            rotation_about_up(found.yaw)[:, 2],
        )
        if plane.agreement >= _SYMMETRIC:
            yaw = float(np.arctan2(plane.normal[0], plane.normal[2]))
            exact = _Hypothesis(found.up, yaw, plane)
            return [exact, exact.reversed()]
        if twists < _TWISTS:
            turned = scorer.twist(*_posed(working, chosen, [found]))[0]
            found = replace(found, yaw=found.yaw + float(turned))
    return [found]


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
