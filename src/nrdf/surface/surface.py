"""The smooth surface that a point cloud stands for."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import tangent_frames, unit_vectors
from nrdf.geometry.quadrics import quadrics

SAME_SIDE = 0.5
"""Least cosine between the normals of points that may belong to one sheet."""
_LEVEL = 0.7  # the same for points that one quadric is fitted to
_NEIGHBOURS, _ASKED = 10, 24  # of one sheet, out of all
_FITTED, _LEAST = 20, 4
_SURE = 0.5  # share of one of fewer points that are a plane, as at the end of a thin part
_COINCIDENT = 1e-4  # spacings within which two points are in one place
_AT_ONCE = 8192  # places: what is known of each takes many times its own memory
_ROUNDS, _WHOLE, _SETTLED = 16, 2, 1e-2  # until nothing moves by more, in spacings or rad


class Surface:
    """An object's points with outward normals, as a surface that other points are mapped to.

    points: (n, 3), m; normals: (n, 3), brought to unit length, outward. The two sides of a thin
    part are distinguished by their normals alone. There is one row for each point given; none
    should repeat another one. Raises ProcessError if the two do not fit each other, are not finite,
    or are fewer than 8.
    """

    def __init__(self, points_m: np.ndarray, normals: np.ndarray) -> None:
        points = np.ascontiguousarray(points_m, dtype=np.float64)
        normals = np.array(normals, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or normals.shape != points.shape:
            raise ProcessError(
                f"points {points.shape} and normals {normals.shape} must both be (n, 3)"
            )
        if len(points) < 8 or not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise ProcessError(
                f"a surface needs at least 8 finite points with normals, not {len(points)}"
            )
        self.points = points
        self.normals = unit_vectors(normals)

    @cached_property
    def tree(self) -> cKDTree:
        return cKDTree(self.points)

    @cached_property
    def _nearest(self) -> tuple[np.ndarray, np.ndarray]:
        return self.tree.query(self.points, min(_ASKED + 1, len(self.points)))

    @cached_property
    def spacing(self) -> float:
        """Typical distance between points, m: the side of the square that each has to itself."""
        count = min(8, len(self.points) - 1)
        return typical_spacing(self._nearest[0][:, count], count)

    @cached_property
    def edges(self) -> np.ndarray:
        """Neighbours (e, 2) on one sheet, each pair once, the lower index first.

        Pairs that rise out of each other's tangent plane, or whose normals differ much, are left
        out, so that no edge leads through a thin part.
        """
        distance, near = self._nearest
        along = self.points[near] - self.points[:, None]
        rise = np.abs(np.einsum("nka,na->nk", along, self.normals))
        rise = np.maximum(rise, np.abs(np.einsum("nka,nka->nk", along, self.normals[near])))
        alike = np.einsum("nka,na->nk", self.normals[near], self.normals) > SAME_SIDE
        good = alike & (rise <= 0.6 * distance) & (distance < 3.0 * self.spacing)
        good[:, 0] = False
        good &= distance > _COINCIDENT * self.spacing  # a pair in one place has no direction
        good &= np.cumsum(good, axis=1) <= _NEIGHBOURS
        i, k = np.nonzero(good)
        pair = np.sort(np.stack([i, near[i, k]], axis=1), axis=1)
        code = np.unique(pair[:, 0] * len(self.points) + pair[:, 1])
        return np.stack(np.divmod(code, len(self.points)), axis=1)

    def project(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest places on the smooth surface, and its normals there, each (m, 3).

        points: (m, 3), m, near the surface; normals: (m, 3), roughly outward, choose the side.
        Moving least squares: a quadric over the tangent plane, fitted to the nearest points of the
        side (Alexa et al., 2003). A point with no surface of its side around stays where it is.
        """
        return self._settled(points, normals)[:2]

    def _settled(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places and normals as of `project`, and whether (m,) there is a surface around."""
        found = _in_parts(
            self._settled_at_once, np.array(points, np.float64), unit_vectors(normals)
        )
        return found[0], found[1], found[2]

    def _settled_at_once(
        self, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        near = self._nearest_to(points, 3 * _FITTED)
        around, facing = self.points[near], self.normals[near]
        fitted = np.zeros(len(points), bool)
        moving = np.arange(len(points))
        for number in range(_ROUNDS):
            places, outward, fitted[moving] = self._fit(
                points[moving], normals[moving], around[moving], facing[moving]
            )
            if number >= _WHOLE:  # the whole turn leads to and fro between two sets of points
                outward = unit_vectors(outward + normals[moving])
            moved = np.linalg.norm(places - points[moving], axis=1) > _SETTLED * self.spacing
            moved |= np.linalg.norm(outward - normals[moving], axis=1) > _SETTLED
            points[moving], normals[moving] = places, outward
            moving = moving[moved]
            if not len(moving):
                break
        fitted[moving] = False  # those that find no rest
        return points, normals, fitted

    def _fit(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        around: np.ndarray,
        around_normals: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One step of `_settled`; around: (m, k, 3) cloud points, with their normals (m, k, 3)."""
        offset = around - points[:, None]
        distance, facing = self._seen(offset, around_normals, normals)
        # Shares fade to 0, or a place would find no rest where points come and go.
        share = np.maximum(facing - _LEVEL, 0.0) / (1.0 - _LEVEL)
        among = np.cumsum(share, axis=1) - share < _FITTED
        reach = 1.05 * (distance * (among & (share > 0.0))).max(axis=1, keepdims=True) + 1e-12
        weight = share * np.maximum(1.0 - (distance / reach) ** 2, 0.0) ** 2
        few = (weight > 0).sum(axis=1) < _LEAST
        fitted = ~few | (share * (weight > 0) > _SURE).any(axis=1)
        # A place that no point is near is beyond the surface's edge.
        fitted &= ((weight > 0) & (distance < 2.0 * self.spacing)).any(axis=1)
        enough = fitted[:, None]
        mean = (weight[:, None] @ around_normals)[:, 0]
        normals = np.where(enough, unit_vectors(mean), normals)
        frame = tangent_frames(normals)
        offset = offset @ frame.transpose(0, 2, 1)
        found = quadrics(offset[..., :2] / self.spacing, offset[..., 2:], weight)
        # Beyond an edge, quadrics run away.
        if few.any():  # a plane, as their normals have it
            total = np.maximum(weight[few].sum(axis=1), 1e-12)
            found[few] = 0.0
            found[few, 0, 0] = (weight[few] * offset[few, :, 2]).sum(axis=1) / total
        height = np.where(enough, np.clip(found[:, 0], -self.spacing, self.spacing), 0.0)
        slope = np.where(enough, found[:, 1:3, 0] / self.spacing, 0.0)
        tilted = normals - np.einsum("ma,mab->mb", slope, frame[:, :2])
        return points + height * normals, unit_vectors(tilted), fitted

    def smooth_normals(
        self, points: np.ndarray, normals: np.ndarray, radius_m: float
    ) -> np.ndarray:
        """Outward normals (m, 3), averaged over what faces a tool at points (m, 3).

        That is the sheet within `radius_m` whose normals turn less than 60° from the average
        itself, which is found from `normals` (m, 3): what a flat tool of that radius feels.
        """
        points = np.asarray(points, dtype=np.float64)
        return _in_parts(partial(self._smooth_at_once, radius_m), points, unit_vectors(normals))[0]

    def _smooth_at_once(
        self, radius_m: float, points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray]:
        radius = max(radius_m, 2.0 * self.spacing)
        count = int(np.clip(2.0 * np.pi * (radius / self.spacing) ** 2, 16, 256))
        near = self._nearest_to(points, count)
        offset, around = self.points[near] - points[:, None], self.normals[near]
        turning = np.arange(len(points))
        for _ in range(_ROUNDS):
            distance, facing = self._seen(offset[turning], around[turning], normals[turning])
            # Fades to 0 at the sheet's edge, so that the average finds its rest.
            facing = np.maximum(facing - SAME_SIDE, 0.0)
            weight = np.maximum(1.0 - (distance / radius) ** 2, 0.0) ** 2 * facing
            mean = (weight[:, None] @ around[turning])[:, 0]
            found = np.where(weight.any(axis=1)[:, None], unit_vectors(mean), normals[turning])
            turned = np.linalg.norm(found - normals[turning], axis=1) > _SETTLED
            normals[turning] = found
            turning = turning[turned]
            if not len(turning):
                break
        return (normals,)

    def _nearest_to(self, points: np.ndarray, count: int) -> np.ndarray:
        return self.tree.query(points, min(count, len(self.points)))[1]

    def _seen(
        self, offset: np.ndarray, around: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Distances (m, k) of cloud points at offset (m, k, 3), and cosines of their normals,
        around (m, k, 3), to normals (m, 3): 0 for points of another sheet."""
        distance = np.sqrt(np.einsum("mka,mka->mk", offset, offset))
        facing = (around @ normals[:, :, None])[..., 0]
        rise = np.abs((offset @ normals[:, :, None])[..., 0]) / self.spacing
        level = np.clip(3.0 + 1.5 * distance / self.spacing - 2.5 * rise, 0.0, 1.0)
        return distance, np.where(facing > SAME_SIDE, facing * level, 0.0)


def typical_spacing(distance: np.ndarray, number: int) -> float:
    """Side of the square that each point has to itself, from the distances (n,) of the points'
    `number`-th neighbours."""
    # Of points spread at random, half have that neighbour within this area.
    return float(np.median(distance) * np.sqrt(np.pi / (number - 1.0 / 3.0)))


def _in_parts(
    call: Callable[..., tuple[np.ndarray, ...]], *arrays: np.ndarray
) -> tuple[np.ndarray, ...]:
    """`call` of arrays (m, ...), whose rows do not concern each other, a part of them at a time."""
    # Rows are written to: a part must not be a view of what was given.
    parts = [
        call(*(array[first : first + _AT_ONCE].copy() for array in arrays))
        for first in range(0, max(len(arrays[0]), 1), _AT_ONCE)
    ]
    return tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))
