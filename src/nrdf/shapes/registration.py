"""Smooth non-rigid registration of two oriented point clouds: the source of correspondences.

Nothing is learned here. A template is moved, starting half-way between its own place and its
bounding box copy, so that nearest neighbours taken both ways in (position, weighted normal) agree,
while displacements are averaged over template neighbourhoods that shrink from coarse to fine
(coherent-point-drift-like smoothing: Myronenko & Song 2010; normals tell the two sides of a thin
part apart). It takes a fraction of a second a pair and gives dense pseudo-correspondences between
*training* shapes, which `nrdf.shapes.correspond` stores and training learns from.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.normals import oriented_features

Array = np.ndarray
_NEIGHBOURS = 4
_ALL_COMPARED = 2**19  # pairs of points up to which comparing all of them is faster than trees


@dataclass(frozen=True)
class RegistrationSettings:
    """How a template is moved onto a target; lengths are in canonical units (longest side 1)."""

    iterations: int = 16
    radius_start: float = 0.25  # smoothing neighbourhood, first and last iteration
    radius_end: float = 0.09
    normal_weight_start: float = 0.3  # length that one unit of normal difference counts for
    normal_weight_end: float = 0.1
    start: float = 0.5  # 0: the template's own place; 1: its copy in the target's bounding box
    match_scale: float = 0.15  # matches farther than this count less and less (Gaussian)

    def radii(self) -> Array:
        """Smoothing radius of each iteration, geometric, shape (iterations,)."""
        return np.geomspace(self.radius_start, self.radius_end, self.iterations)

    def normal_weights(self) -> Array:
        """Normal weight of each iteration, geometric, shape (iterations,)."""
        return np.geomspace(self.normal_weight_start, self.normal_weight_end, self.iterations)


@dataclass(frozen=True)
class Registration:
    """Where a template's points arrive on a target.

    points: (n, 3) mapped template points, smooth, near the target's surface.
    target_index: (n,) nearest target point in (position, normal, what is alike).
    distance: (n,) distance to it in (position, weighted normal, what is alike).
    back: (m,) distance of each target point from the nearest of `points`, likewise.
    """

    points: Array
    target_index: Array
    distance: Array
    back: Array


class RegistrationTemplate:
    """A template's points, normals and smoothing kernels, made once and used for many targets.

    points: (n, 3); normals: (n, 3), unit. Memory is iterations · n² · 4 bytes: about 1000 to 2000
    points are meant.
    """

    def __init__(
        self, points: Array, normals: Array, settings: RegistrationSettings | None = None
    ) -> None:
        self.settings = settings or RegistrationSettings()
        self.points = np.asarray(points, np.float32)
        self.normals = np.asarray(normals, np.float32)
        squared = _squared_distances(self.points)
        # Plain numbers: numpy's own would make the kernels double, twice as large and slow.
        self._kernels = [np.exp(squared * (-2.0 / r**2)) for r in self.settings.radii().tolist()]

    def register(
        self,
        target_points: Array,
        target_normals: Array,
        start: tuple[Array, Array] | None = None,
        alike: tuple[Array, Array] | None = None,
    ) -> Registration:
        """Move the template onto a target given by points (m, 3) and unit normals (m, 3).

        `start`: points and unit normals (n, 3) from which to begin, where something better than
        the bounding box is known. `alike`: features (n, a) of the template and (m, a) of the
        target, as lengths, in which neighbours are near as well.
        """
        s = self.settings
        target = np.asarray(target_points, np.float32)
        normals = np.asarray(target_normals, np.float32)
        if start is None:
            base, own = self._from_box(target), self.normals
        else:
            base, own = (np.asarray(values, np.float32) for values in start)
        moved = base
        balance = len(base) / len(target)
        for kernel, normal_weight in zip(self._kernels, s.normal_weights(), strict=True):
            to_target, target_index, to_moved, moved_index = _match(
                moved, own, target, normals, float(normal_weight), alike
            )
            forward = np.exp(-((to_target / s.match_scale) ** 2)).astype(np.float32)
            backward = balance * np.exp(-((to_moved / s.match_scale) ** 2)).astype(np.float32)
            sums = np.zeros((len(base), 4), np.float32)
            sums[:, :3] = forward[:, None] * (target[target_index] - base)
            sums[:, 3] = forward
            pulled = np.concatenate(
                [backward[:, None] * (target - base[moved_index]), backward[:, None]], 1
            )
            for column in range(4):
                sums[:, column] += np.bincount(moved_index, pulled[:, column], len(base))
            smooth = kernel @ sums
            moved = base + smooth[:, :3] / np.maximum(smooth[:, 3:], 1e-6)
        distance, index, back, _ = _match(moved, own, target, normals, s.normal_weight_end, alike)
        return Registration(moved.astype(np.float32), index, distance, back)

    def _from_box(self, target: Array) -> Array:
        """The template on its way from its own place to the target's bounding box."""
        low, high = self.points.min(0), self.points.max(0)
        target_low, target_high = target.min(0), target.max(0)
        extent = np.maximum(high - low, 1e-6)
        box_copy = (self.points - low) / extent * (target_high - target_low) + target_low
        return (1 - self.settings.start) * self.points + self.settings.start * box_copy


class DisplacementInterpolator:
    """Displacements of points (n, 3) from those of a few, `known` (k, 3).

    Each point moves like its `_NEIGHBOURS` nearest of the known ones, weighted by the inverse
    square of the distance.
    """

    def __init__(self, known: Array, points: Array) -> None:
        count = min(_NEIGHBOURS, len(known))
        distance, self._nearest = cKDTree(known).query(points, range(1, count + 1))
        weight = 1.0 / (distance + 1e-3) ** 2
        self._weight = weight / weight.sum(axis=1, keepdims=True)

    def interpolate(self, displacement: Array) -> Array:
        """Displacements (n, 3) of the points from those of the known ones, (k, 3)."""
        return np.einsum("nk,nka->na", self._weight, displacement[self._nearest])


def _match(
    moved: Array,
    own: Array,
    target: Array,
    normals: Array,
    normal_weight: float,
    alike: tuple[Array, Array] | None,
) -> tuple[Array, Array, Array, Array]:
    """Nearest neighbours both ways in (position, weighted normal, what is `alike`): distances and
    indices."""
    moved_features = oriented_features(moved, own, normal_weight)
    target_features = oriented_features(target, normals, normal_weight)
    if alike is not None:
        moved_features = np.concatenate([moved_features, alike[0]], axis=1, dtype=np.float32)
        target_features = np.concatenate([target_features, alike[1]], axis=1, dtype=np.float32)
    if len(moved) * len(target) <= _ALL_COMPARED:
        return _match_all(moved_features, target_features)
    to_target, target_index = cKDTree(target_features).query(moved_features)
    to_moved, moved_index = cKDTree(moved_features).query(target_features)
    return to_target, target_index, to_moved, moved_index


def _match_all(one: Array, two: Array) -> tuple[Array, Array, Array, Array]:
    """As of `_match`, of features (n, f) and (m, f), by comparing all with all."""
    index, back = _nearest_of_all(one, two), _nearest_of_all(two, one)
    there, here = one - two[index], two - one[back]
    return np.sqrt((there**2).sum(1)), index, np.sqrt((here**2).sum(1)), back


def _nearest_of_all(one: Array, two: Array) -> Array:
    """For each of (n, f) the nearest of (m, f): that of the least |b|² - 2ab, one product."""
    left = np.concatenate([one, np.ones((len(one), 1), one.dtype)], 1)
    right = np.concatenate([-2 * two, (two**2).sum(1, keepdims=True)], 1)
    return np.asarray((left @ right.T).argmin(1))


def _squared_distances(points: Array) -> Array:
    norms = (points**2).sum(1)
    return np.maximum(norms[:, None] + norms[None] - 2 * points @ points.T, 0)
