"""Surfaces mapped by smooth non-rigid registration, of objects of any category.

A subset of the source is moved onto the target, and all other points go along with their nearest of
the subset. The same is done the other way round, from the target to the source. Two things tell
where the map can be believed: how far a mapped point is from the target in position and normal,
and how far from its own place it comes back to. Neighbours are near in local shape as well
(`nrdf.geometry.local_shape`), so that a leg is matched to legs.

Registration alone begins half-way to the target's bounding box (the model `registration`). With the
general field it begins where that puts the points, and the error that the field expects tells what
of the target has no counterpart.
"""

from __future__ import annotations

from functools import cached_property
from threading import Lock

import numpy as np
import torch

from nrdf.field.base import Inverse
from nrdf.field.cloud_encoder import CloudEncoder
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.field.general import GeneralField
from nrdf.regions.mapping import MappedPoints
from nrdf.regions.presence import FIELD_RULE, REGISTRATION_RULE, PresenceRule
from nrdf.shapes.registration import (
    DisplacementInterpolator,
    RegistrationSettings,
    RegistrationTemplate,
)

_POINTS = 2048  # of the source, registered to twice as many of the target
_BACK_POINTS = 1024  # of the target, likewise the other way round
_KEPT = 2  # targets whose registration is kept
# Canonical length that one unit of difference in local shape counts for: a leg is matched to legs.
_ALIKE_WEIGHT = 0.1
# Odds that a mapped point lies on the right part: (doubt / _EVEN) ** -_STEEPNESS, the doubt being
# its distance from the target and that much of how far it comes back to. A logistic regression on
# the points of 74 pairs of labelled tables, benches, chairs and stools.
CYCLE_WEIGHT, _EVEN, _STEEPNESS = 0.39, 0.072, 1.32
_FROM_FIELD = RegistrationSettings(iterations=8)  # half as many where the field has begun


class RegistrationMapper:
    """Maps a source's surface by registering it to each target, once; may be used by threads.

    model: of the general field, which begins; None for registration alone. The smoothing kernels
    take about 270 MB, half as much with a field.
    """

    def __init__(self, source: EncodedCloud, model: CloudEncoder | None = None) -> None:
        self.source, self._model = source, model
        self.presence_rule: PresenceRule = REGISTRATION_RULE if model is None else FIELD_RULE
        self._settings = RegistrationSettings() if model is None else _FROM_FIELD
        self._chosen = _subset(len(source.points), _POINTS, 0)
        self._template = RegistrationTemplate(
            source.points[self._chosen], source.normals[self._chosen], self._settings
        )
        self._pairs: list[RegisteredPair] = []
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

    def _pair(self, target: EncodedCloud) -> RegisteredPair:
        with self._lock:
            for pair in self._pairs:
                if pair.target is target:
                    return pair
            pair = self.register(target)
            self._pairs = [pair, *self._pairs][:_KEPT]
            return pair

    def register(self, target: EncodedCloud) -> RegisteredPair:
        """The source registered to a target, and the target to the source; nothing is kept."""
        source, back = self.source, _subset(len(target.points), _BACK_POINTS, 2)
        there = _Moved(source.points[self._chosen], source.normals[self._chosen])
        returning = _Moved(target.points[back], target.normals[back])
        if self._model is not None:
            there, returning = _begun(self._model, source, target, there, returning)
        sample = _subset(len(target.points), 2 * _POINTS, 1)
        own, other = (_ALIKE_WEIGHT * features for features in source.alike_features(target))
        there.register(
            self._template,
            target.points[sample],
            target.normals[sample],
            (own[self._chosen], other[sample]),
        )
        sample = _subset(len(source.points), 2 * _BACK_POINTS, 3)
        template = RegistrationTemplate(returning.points, returning.normals, self._settings)
        returning.register(
            template, source.points[sample], source.normals[sample], (other[back], own[sample])
        )
        return RegisteredPair(source, target, there, returning)


class _Moved:
    """Points and normals (k, 3) of one shape, where they are on another, and the error (k,) that is
    to be expected there."""

    def __init__(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        start: np.ndarray | None = None,
        error: np.ndarray | None = None,
    ) -> None:
        self.points, self.normals = points, normals
        self._start = start
        self._error = np.zeros(len(points)) if error is None else error
        self._displacement = np.zeros_like(points)

    def register(
        self,
        template: RegistrationTemplate,
        points: np.ndarray,
        normals: np.ndarray,
        alike: tuple[np.ndarray, np.ndarray],
    ) -> None:
        """Move the points onto those of the other shape, as `RegistrationTemplate.register`."""
        start = None if self._start is None else (self._start, self.normals)
        self._displacement = template.register(points, normals, start, alike).points - self.points

    def follow(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where other points (m, 3) arrive, and the error (m,) to be expected there."""
        along = np.concatenate([self._displacement, self._error[:, None]], axis=1)
        moved = DisplacementInterpolator(self.points, points).interpolate(along)
        return points + moved[:, :3], moved[:, 3]


class RegisteredPair:
    """A source registered to a target, and the target to the source."""

    def __init__(
        self, source: EncodedCloud, target: EncodedCloud, there: _Moved, back: _Moved
    ) -> None:
        self.target, self._source, self._there, self._back = target, source, there, back

    @cached_property
    def whole(self) -> MappedPoints:
        """The source's working points on the target."""
        return self.map_points(self._source.points, self._source.normals)

    def forward(self, points: np.ndarray) -> np.ndarray:
        """Where canonical points (m, 3) of the source arrive on the target, (m, 3)."""
        return self._there.follow(points)[0]

    def backward(self, points: np.ndarray) -> np.ndarray:
        """Where canonical points (m, 3) of the target arrive on the source, (m, 3)."""
        return self._back.follow(points)[0]

    def map_points(self, points: np.ndarray, normals: np.ndarray) -> MappedPoints:
        """Canonical points and normals (m, 3) of the source on the target."""
        moved, error = self._there.follow(points)
        distance = self.target.distance(moved, normals)
        returned, _ = self._back.follow(moved)
        doubt = distance + CYCLE_WEIGHT * np.linalg.norm(returned - points, axis=1)
        existence = 1.0 / (1.0 + (doubt / _EVEN) ** _STEEPNESS)
        return MappedPoints(moved, normals, existence, error, np.zeros((len(points), 3)))

    def map_back(self, points: np.ndarray, normals: np.ndarray) -> MappedPoints:
        """Canonical points and normals (m, 3) of the target on the source."""
        returned, error = self._back.follow(points)
        count = len(points)
        return MappedPoints(returned, normals, np.ones(count), error, np.zeros((count, 3)))


def _begun(
    model: CloudEncoder, source: EncodedCloud, target: EncodedCloud, there: _Moved, back: _Moved
) -> tuple[_Moved, _Moved]:
    """The same, beginning where the general field puts them."""
    assert isinstance(model.field, GeneralField)
    with torch.inference_mode():
        maps = model.field.correspond(source.z, target.z)
        found = [
            map_.transfer(model.tensor(moved.points)[None], model.tensor(moved.normals)[None])
            for map_, moved in zip(maps, (there, back), strict=True)
        ]
    return _from_inverse(there, found[0]), _from_inverse(back, found[1])


def _from_inverse(moved: _Moved, inverse: Inverse) -> _Moved:
    assert inverse.log_error is not None
    places, errors = inverse.points[0].cpu().numpy(), inverse.log_error[0].exp().cpu().numpy()
    return _Moved(moved.points, moved.normals, places, errors)


def _subset(total: int, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).permutation(total)[:count]
