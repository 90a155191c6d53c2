"""What regions cost when nothing is learned: copied points, and a registration."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from nrdf.geometry.canonical import bounding_box, canonical_transform
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import fibonacci_directions
from nrdf.io.cloud import PointCloud
from nrdf.regions.association import nearest_voters, snap
from nrdf.regions.region import region_indices
from nrdf.shapes.registration import DisplacementInterpolator, RegistrationTemplate

SEED = 0
TEMPLATE_POINTS = 2048
COPIED_NORMAL_WEIGHT = 0.15
"""Canonical length that one unit of normal difference counts for where copies are snapped."""
_NEIGHBOURS = 9  # of each normal's plane
_DIRECTIONS = 60
_CAMERA = 10.0  # canonical distance of the viewpoints from the object's middle
_SPHERE = 1e4  # radius of the sphere that points are flipped at, in farthest distances from it


class SnappedCopy:
    """Nothing learned, nothing moved but, with `box`, the bounding box.

    Each point of a region is snapped to the nearest target point; with `normals` to the nearest in
    (x, 0.15·normal), the normals from `hidden_point_normals`, whatever normals the clouds have.
    """

    def __init__(self, box: bool, normals: bool) -> None:
        self.box, self.weight = box, COPIED_NORMAL_WEIGHT if normals else 0.0

    def __call__(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud
    ) -> dict[str, np.ndarray]:
        points = reference.points
        if self.box:
            points = _in_box(points, target.points)
        chosen = _all_indices(reference, regions)
        asked = np.concatenate(list(chosen.values()))
        weight = self.weight * canonical_transform(target.points)[1]
        index, _ = snap(
            points[asked], self._oriented(reference)[asked],
            target.points, self._oriented(target), weight,
        )  # fmt: skip
        ends = np.cumsum([len(indices) for indices in chosen.values()])
        return dict(zip(chosen, np.split(index, ends[:-1]), strict=True))

    def _oriented(self, cloud: PointCloud) -> np.ndarray:
        """A cloud's normals; zeros where none are asked for."""
        if not self.weight:
            return np.zeros_like(cloud.points)
        return _hidden_point_normals(cloud.points.tobytes())


class BoundingBoxMask:
    """The reference in the target's bounding box, which takes the regions as masks: each target
    point is in a region if most of the reference's points nearest to it are, in position and
    normal."""

    def __call__(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud
    ) -> dict[str, np.ndarray]:
        (own, normals), (points, target_normals) = map(_canonical, (reference, target))
        return _voted(reference, regions, _in_box(own, points), normals, points, target_normals)


class RegistrationMask:
    """Registration of the reference to the target, which takes the regions as masks.

    `nrdf.shapes.registration` moves a subset of the reference, with the defaults by which it
    teaches the field; all of the reference's points go along with their nearest of the subset, and
    each target point is in a region if most of the mapped points nearest to it are, in position and
    normal.
    """

    def __init__(self) -> None:
        # One at a time, because its kernels take hundreds of megabytes; pairs come by reference.
        self._last: tuple[PointCloud, _Template] | None = None

    def __call__(
        self, reference: PointCloud, regions: Mapping[str, Any], target: PointCloud
    ) -> dict[str, np.ndarray]:
        if self._last is None or self._last[0] is not reference:
            self._last = None
            self._last = (reference, _Template(*_canonical(reference)))
        template = self._last[1]
        points, normals = _canonical(target)
        mapped = template.map_surface(points, normals)
        return _voted(reference, regions, mapped, template.normals, points, normals)


class _Template:
    """A reference, canonical: points and normals (n, 3), and the subset that is registered."""

    def __init__(self, points: np.ndarray, normals: np.ndarray) -> None:
        self.points, self.normals = points, normals
        self.chosen = np.random.default_rng(SEED).permutation(len(points))[:TEMPLATE_POINTS]
        self.registered = RegistrationTemplate(points[self.chosen], normals[self.chosen])
        self.interpolator = DisplacementInterpolator(points[self.chosen], points)

    def map_surface(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Where the reference's points arrive on a target (m, 3) with normals: (n, 3)."""
        rng = np.random.default_rng(SEED + 1)
        sample = rng.permutation(len(points))[: 2 * TEMPLATE_POINTS]
        arrived = self.registered.register(points[sample], normals[sample]).points
        return self.points + self.interpolator.interpolate(arrived - self.points[self.chosen])


def hidden_point_normals(points: np.ndarray) -> np.ndarray:
    """Outward unit normals (n, 3) of a full cloud (n, 3), as the table of baselines took them.

    Line: principal component analysis of 9 neighbours. Sign: hidden-point removal (Katz et al.
    2007) from 60 directions, each direction that sees a point voting for the side it sees it from.
    Simpler, slower and less often right than `nrdf.geometry.normals.estimate_normals`. Raises
    CloudError for an empty cloud.
    """
    centre, scale = canonical_transform(points)
    points = (points - centre) / scale
    near = points[cKDTree(points).query(points, min(_NEIGHBOURS, len(points)))[1]]
    offset = near - near.mean(axis=1, keepdims=True)
    lines = np.linalg.eigh(offset.transpose(0, 2, 1) @ offset)[1][:, :, 0]
    votes = np.zeros(len(points))
    # Which few signs come out wrong hangs on how the lattice of directions is turned: chairs'
    # figures change by up to 3 % with it. With its pole along x all stay within 2 %.
    for view in fibonacci_directions(_DIRECTIONS)[:, [2, 0, 1]]:
        seen = _visible_from(points, _CAMERA * view)
        votes[seen] += np.sign(lines[seen] @ view)
    return np.where(votes < 0.0, -1.0, 1.0)[:, None] * lines


@lru_cache(maxsize=64)
def _hidden_point_normals(points: bytes) -> np.ndarray:
    """The normals of the latest clouds are kept: they take a second, and each is in many pairs."""
    return hidden_point_normals(np.frombuffer(points).reshape(-1, 3))


def _visible_from(points: np.ndarray, viewpoint: np.ndarray) -> np.ndarray:
    """Indices of the points that hidden-point removal leaves (Katz, Tal and Basri 2007)."""
    offset = points - viewpoint
    distance = np.linalg.norm(offset, axis=1, keepdims=True)
    flipped = offset + 2 * (_SPHERE * distance.max() - distance) * offset / distance
    corners = ConvexHull(np.concatenate([flipped, np.zeros((1, 3))])).vertices
    return corners[corners < len(points)]


def _in_box(points: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Points (n, 3) after their bounding box was brought onto that of a target (m, 3)."""
    low, high = bounding_box(points)
    target_low, target_high = bounding_box(target)
    extent = np.maximum(high - low, 1e-12)
    return (points - low) / extent * (target_high - target_low) + target_low


def _voted(
    reference: PointCloud,
    regions: Mapping[str, Any],
    mapped: np.ndarray,
    mapped_normals: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
) -> dict[str, np.ndarray]:
    """A target's points (m, 3) of which most of the nearest mapped points (n, 3) are in a region,
    by name."""
    asked, _ = nearest_voters(mapped, mapped_normals, points, normals)
    found = {}
    for name, indices in _all_indices(reference, regions).items():
        member = np.zeros(len(reference.points), bool)
        member[indices] = True
        found[name] = np.flatnonzero(member[asked].mean(axis=1) > 0.5)
    return found


def _all_indices(reference: PointCloud, regions: Mapping[str, Any]) -> dict[str, np.ndarray]:
    tree = cKDTree(reference.points)
    return {
        name: region_indices(region, reference, lambda: tree) for name, region in regions.items()
    }


def _canonical(cloud: PointCloud) -> tuple[np.ndarray, np.ndarray]:
    centre, scale = canonical_transform(cloud.points)
    normals = estimate_normals(cloud.points) if cloud.normals is None else cloud.normals
    return (cloud.points - centre) / scale, normals
