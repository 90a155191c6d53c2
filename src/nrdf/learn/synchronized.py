"""Correspondences within a collection of objects of one kind, made consistent by one another.

Each object is mapped onto each other one directly, and by way of every third one. Ways that are
wrong are wrong in ways of their own, and those that are right agree. So the place of a point is a
robust mean of where all ways lead, in which those that come back to the point count most: the maps
are synchronized (Nguyen et al., SGP 2011; Huang and Guibas, SGP 2013). Nothing about the kind need
be known. Taken by way of eight other aircraft, the regions of BSRC's are 7 % nearer than directly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import combinations

import numpy as np

from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.learn.objects import cloud_of
from nrdf.regions.model import Model
from nrdf.regions.registration_mapper import RegisteredPair, RegistrationMapper
from nrdf.shapes.dataset import Shape
from nrdf.training.general_pairs import MEMBERS, POINTS, Groups

AT_ONCE = 16
"""Objects whose maps are made consistent together; of more, several sets are drawn."""
_GROUPS = 15  # for each object
_ROUNDS = 10  # of a robust mean
_DOUBT, _NEAR = 0.01, 0.003  # added to what weights are divided by, in longest sides
_BELIEVED = 0.05  # doubt up to which a place is taught

Follow = Callable[[np.ndarray], np.ndarray]


def synchronized_groups(
    model: Model,
    shapes: Sequence[Shape],
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> Groups:
    """Groups of shapes (in one frame) for training, with the places of the points of
    each on the others.

    model: the general one, which the direct maps come from. About 0.2 s of one core for each pair
    of shapes. `progress` is told (done, all).
    """
    rng = np.random.default_rng(seed)
    clouds = [model.encode(cloud_of(shape)) for shape in shapes]
    sets = _draw_sets(len(clouds), rng)
    groups: list[tuple[np.ndarray, ...]] = []
    for done, members in enumerate(sets):
        tell = partial(_tell, progress, done, len(sets))
        groups += _groups_of(model, [clouds[n] for n in members], rng, tell)
    points, normals, exists = (np.stack(values) for values in zip(*groups, strict=True))
    return Groups(points, normals, exists)


def _draw_sets(count: int, rng: np.random.Generator) -> list[np.ndarray]:
    """Sets of at most `AT_ONCE` of `count` objects that hold each at least once."""
    order, size = rng.permutation(count), min(AT_ONCE, count)
    starts = np.linspace(0, count - size, -(-count // size)).round().astype(int)
    return [order[start : start + size] for start in starts]


def _groups_of(
    model: Model,
    clouds: Sequence[EncodedCloud],
    rng: np.random.Generator,
    progress: Callable[[int, int], None],
) -> list[tuple[np.ndarray, ...]]:
    own = [rng.choice(len(cloud.points), POINTS, len(cloud.points) < POINTS) for cloud in clouds]
    maps = _direct_maps(model, clouds, progress)
    count = len(clouds)
    points = np.empty((count, count, POINTS, 3))  # on the first, of the second's own points
    normals, exists = np.empty_like(points), np.empty((count, count, POINTS), bool)
    for source in range(count):
        at, facing = (v[own[source]] for v in (clouds[source].points, clouds[source].normals))
        for target in range(count):
            if source == target:
                found = at, facing, np.ones(POINTS, bool)
            else:
                found = _place(maps, clouds[target], source, target, at, facing)
            points[target, source], normals[target, source], exists[target, source] = found
    groups: list[tuple[np.ndarray, ...]] = []
    for _ in range(_GROUPS * count):
        chosen = rng.choice(count, MEMBERS, replace=count < MEMBERS)
        part = np.ix_(chosen, chosen)
        groups.append(
            (
                points[part].reshape(MEMBERS, -1, 3).astype(np.float16),
                normals[part].reshape(MEMBERS, -1, 3).astype(np.float16),
                exists[part].reshape(MEMBERS, -1),
            )
        )
    return groups


def _direct_maps(
    model: Model, clouds: Sequence[EncodedCloud], progress: Callable[[int, int], None]
) -> dict[tuple[int, int], Follow]:
    """The map of each cloud onto each other one, by their numbers."""
    mappers = [RegistrationMapper(cloud, model) for cloud in clouds]
    pairs = list(combinations(range(len(clouds)), 2))
    maps: dict[tuple[int, int], Follow] = {}
    for done, (one, other) in enumerate(pairs, 1):
        pair: RegisteredPair = mappers[one].register(clouds[other])
        maps[one, other], maps[other, one] = pair.forward, pair.backward
        progress(done, len(pairs))
    return maps


def _place(
    maps: dict[tuple[int, int], Follow],
    target_cloud: EncodedCloud,
    source: int,
    target: int,
    points: np.ndarray,
    normals: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where points (m, 3) with normals of a source are on a target, the normals there, and whether
    (m,) they are there at all, by all ways."""
    count = len({one for one, _ in maps})
    places, doubts = [], []
    for via in range(count):
        if via == source:
            continue
        place = maps[source, via](points)
        back = place
        if via != target:
            place = maps[via, target](place)
            back = maps[target, via](place)
        back = maps[via, source](back)
        away = np.linalg.norm(back - points, axis=1)
        places.append(place)
        doubts.append(away + target_cloud.distance(place, normals))
    ways = np.stack(places)
    weights = (_DOUBT + np.stack(doubts)) ** -2.0
    mean = _mean(ways, weights)
    for _ in range(_ROUNDS):  # a weighted geometric median, by Weiszfeld's algorithm
        mean = _mean(ways, weights / (_NEAR + np.linalg.norm(ways - mean, axis=-1)))
    apart = (weights * np.linalg.norm(ways - mean, axis=-1)).sum(0) / weights.sum(0)
    exists = apart + target_cloud.distance(mean, normals) < _BELIEVED
    nearest = target_cloud.nearest(mean, normals, 1)[:, 0]
    return mean, target_cloud.normals[nearest], exists


def _mean(ways: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.asarray((weights[..., None] * ways).sum(0) / weights.sum(0)[:, None])


def _tell(
    progress: Callable[[int, int], None] | None, before: int, sets: int, done: int, total: int
) -> None:
    if progress is not None:
        progress(before * total + done, sets * total)
