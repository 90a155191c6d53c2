"""Surfaces mapped by smooth non-rigid registration: nothing is learned, so for any category.

A subset of the source is moved onto the target, and all other points go along with their nearest of
the subset. The same is done the other way round, from the target to the source. Two things tell
where the map can be believed: how far a mapped point is from the target in position and normal,
and how far from its own place it comes back to.
"""

from __future__ import annotations

from threading import Lock
from typing import ClassVar

import numpy as np

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.regions.mapping import MappedPoints
from nrdf.regions.presence import REGISTRATION_RULE, PresenceRule
from nrdf.shapes.registration import DisplacementInterpolator, RegistrationTemplate

_POINTS = 2048  # of the source, registered to twice as many of the target
_BACK_POINTS = 1024  # of the target, likewise the other way round
_KEPT = 2  # targets whose registration is kept
# Odds that a mapped point lies on the right part: (doubt / _EVEN) ** -_STEEPNESS, the doubt being
# its distance from the target and that much of how far it comes back to. A logistic regression on
# the points of 74 pairs of labelled tables, benches, chairs and stools.
CYCLE_WEIGHT, _EVEN, _STEEPNESS = 0.39, 0.072, 1.32


class RegistrationMapper:
    """Maps a source's surface by registering it to each target, once; may be used by threads.

    Its smoothing kernels take about 270 MB.
    """

    presence_rule: ClassVar[PresenceRule] = REGISTRATION_RULE

    def __init__(self, source: EncodedCloud) -> None:
        self.source = source
        self._chosen = _subset(len(source.points), _POINTS, 0)
        self._template = RegistrationTemplate(
            source.points[self._chosen], source.normals[self._chosen]
        )
        self._pairs: list[_RegisteredPair] = []
        self._lock = Lock()

    def map_working(self, target: EncodedCloud, chosen: np.ndarray | None = None) -> MappedPoints:
        """As of `SurfaceMapper`."""
        mapped = self._pair(target).whole
        return mapped if chosen is None else mapped.select(chosen)

    def map_points(
        self, points: np.ndarray, normals: np.ndarray, target: EncodedCloud
    ) -> MappedPoints:
        """As of `SurfaceMapper`."""
        return self._pair(target).map_points(points, normals)

    map_precisely = map_points

    def map_back(self, target: EncodedCloud, chosen: np.ndarray | slice) -> MappedPoints:
        """As of `SurfaceMapper`."""
        return self._pair(target).map_back(target.points[chosen], target.normals[chosen])

    def _pair(self, target: EncodedCloud) -> _RegisteredPair:
        with self._lock:
            for pair in self._pairs:
                if pair.target is target:
                    return pair
            pair = _RegisteredPair(self.source, self._chosen, self._template, target)
            self._pairs = [pair, *self._pairs][:_KEPT]
            return pair


class _RegisteredPair:
    """A source registered to a target, and the target to the source."""

    def __init__(
        self,
        source: EncodedCloud,
        chosen: np.ndarray,
        template: RegistrationTemplate,
        target: EncodedCloud,
    ) -> None:
        self.source, self.target = source, target
        self._from = source.points[chosen]
        sample = _subset(len(target.points), 2 * _POINTS, 1)
        arrived = template.register(target.points[sample], target.normals[sample]).points
        self._moved = arrived - self._from
        returning = _subset(len(target.points), _BACK_POINTS, 2)
        self._back_from = target.points[returning]
        sample = _subset(len(source.points), 2 * _BACK_POINTS, 3)
        back = RegistrationTemplate(self._back_from, target.normals[returning])
        arrived = back.register(source.points[sample], source.normals[sample]).points
        self._moved_back = arrived - self._back_from
        self.whole = self.map_points(source.points, source.normals)

    def map_points(self, points: np.ndarray, normals: np.ndarray) -> MappedPoints:
        """Canonical points and normals (m, 3) of the source on the target."""
        moved = points + DisplacementInterpolator(self._from, points).interpolate(self._moved)
        distance = self.target.distance(moved, normals)
        returned = self._returned(moved)
        doubt = distance + CYCLE_WEIGHT * np.linalg.norm(returned - points, axis=1)
        existence = 1.0 / (1.0 + (doubt / _EVEN) ** _STEEPNESS)
        count = len(points)
        return MappedPoints(moved, normals, existence, np.zeros(count), np.zeros((count, 3)))

    def map_back(self, points: np.ndarray, normals: np.ndarray) -> MappedPoints:
        """Canonical points and normals (m, 3) of the target on the source."""
        returned = self._returned(points)
        count = len(points)
        return MappedPoints(
            returned, normals, np.ones(count), np.zeros(count), np.zeros((count, 3))
        )

    def _returned(self, points: np.ndarray) -> np.ndarray:
        along = DisplacementInterpolator(self._back_from, points)
        return points + along.interpolate(self._moved_back)


def _subset(total: int, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).permutation(total)[:count]
