"""Methods on categories that a model has not seen: regions of BSRC, parts of labelled objects.

Every pair is measured by every method in the same run, and methods are compared pair by pair. Of
what is found, points whose label counts nowhere are left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np

from nrdf.errors import DataError
from nrdf.io.cloud import PointCloud
from nrdf_benchmark.bsrc.dataset import FOLDERS, read_bsrc
from nrdf_benchmark.methods.registry import Method
from nrdf_benchmark.metrics import MISSED, chamfer_l1
from nrdf_benchmark.objects.dataset import read_labels, read_objects
from nrdf_benchmark.objects.pairs import draw_pairs, parts_of
from nrdf_benchmark.objects.sampling import sample_object

UNSEEN_WEIGHTS = Path(__file__).parent / "zoo" / "general-unseen.safetensors"
"""The general field before it saw any car, aircraft, table or desk. The zoo's `general` begins with
these weights, and has seen all kinds."""
_RESAMPLES = 4000


@dataclass(frozen=True)
class UnseenObject:
    """A cloud with normals, its regions as indices (k,), and which points (n,) count."""

    name: str
    cloud: PointCloud
    regions: Mapping[str, np.ndarray]
    counts: np.ndarray


@dataclass(frozen=True)
class UnseenResult:
    """A method on a category: cd (pairs,), mean CD-L1 of each pair's regions, a region found
    nowhere counting as 1; found (pairs,), of those found somewhere; cpu_s (pairs,), processor
    seconds; missed: regions found nowhere."""

    method: str
    cd: np.ndarray
    found: np.ndarray
    cpu_s: np.ndarray
    missed: int


@dataclass(frozen=True)
class Comparison:
    """How much lower a method's mean CD-L1 is than another's, as a share of that, with an interval
    of 95 % (bootstrap over the targets, each with all its pairs)."""

    lower: float
    low: float
    high: float


def read_unseen(
    category: str, bsrc: Path | None, objects: Path | None, labels: str = "published"
) -> list[UnseenObject]:
    """The objects of a category: BSRC's with `bsrc` where it has the category, else labelled ones.

    labels: how BSRC's are read (`read_bsrc`).

    Raises DataError where neither folder is given for it, or as their readers do.
    """
    if bsrc is not None and category in FOLDERS:
        return [
            UnseenObject(item.name, item.cloud, item.truth, np.ones(len(item.cloud.points), bool))
            for item in read_bsrc(bsrc, category, labels).objects
        ]
    if objects is None:
        raise DataError(f"no objects of category {category}: give --objects (or --bsrc for BSRC's)")
    names, found = read_labels(objects), []
    for mesh in read_objects(objects, [category]):
        sample = sample_object(mesh)
        counts = ~np.isin(sample.label, names.ignored)
        found.append(UnseenObject(mesh.key, sample.cloud, parts_of(names, sample), counts))
    return found


def unseen_pairs(
    objects: Sequence[UnseenObject], most: int
) -> list[tuple[UnseenObject, UnseenObject]]:
    """Ordered pairs of different objects that share a region, at most so many, drawn at random."""
    named = {item.name: item for item in objects}
    shared = [
        (one.name, other.name)
        for one, other in permutations(objects, 2)
        if set(one.regions) & set(other.regions)
    ]
    return [(named[one], named[other]) for one, other in draw_pairs(shared, most)]


def evaluate_unseen(
    methods: Mapping[str, Method],
    pairs: Sequence[tuple[UnseenObject, UnseenObject]],
    progress: Callable[[int, int], None],
) -> list[UnseenResult]:
    """Run all methods on each pair, one after the other. `progress` is told (done, all)."""
    distances: dict[str, list[list[float]]] = {name: [] for name in methods}
    seconds: dict[str, list[float]] = {name: [] for name in methods}
    for done, (reference, target) in enumerate(pairs, 1):
        regions = {n: at for n, at in reference.regions.items() if n in target.regions}
        for name, match in methods.items():
            start = time.process_time()
            found = match(reference.cloud, regions, target.cloud)
            seconds[name].append(time.process_time() - start)
            distances[name].append([_distance(found[n], n, target) for n in regions])
        progress(done, len(pairs))
    return [
        UnseenResult(
            name,
            np.array([np.mean(row) for row in rows]),
            np.array([_mean_found(row) for row in rows]),
            np.array(seconds[name]),
            sum(value == MISSED for row in rows for value in row),
        )
        for name, rows in distances.items()
    ]


def compare(
    result: UnseenResult, base: UnseenResult, pairs: Sequence[tuple[UnseenObject, UnseenObject]]
) -> Comparison:
    """A method beside another one, `base`, of the same pairs."""
    targets = [target.name for _, target in pairs]
    known = list(dict.fromkeys(targets))
    which = np.array([known.index(name) for name in targets])
    own, other = (np.bincount(which, values) for values in (result.cd, base.cd))
    drawn = np.random.default_rng(0).integers(0, len(known), (_RESAMPLES, len(known)))
    ratios = 1 - own[drawn].sum(1) / other[drawn].sum(1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    return Comparison(float(1 - own.sum() / other.sum()), float(low), float(high))


def _distance(found: np.ndarray, name: str, target: UnseenObject) -> float:
    found = found[target.counts[found]]
    if not len(found):
        return MISSED
    points = target.cloud.points
    return chamfer_l1(points[found], points[target.regions[name]])


def _mean_found(row: Sequence[float]) -> float:
    found = [value for value in row if value != MISSED]
    return float(np.mean(found)) if found else float("nan")
