"""Table II: every method on every ordered pair of BSRC, in parallel, going on where it was."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nrdf.errors import DataError
from nrdf.tasks import TaskLost, Workers, run_tasks
from nrdf_benchmark.bsrc.dataset import Benchmark, BenchmarkObject
from nrdf_benchmark.methods.registry import Method, MethodSpec, build_method
from nrdf_benchmark.metrics import score
from nrdf_benchmark.result_cache import PairCache, PairResult


@dataclass(frozen=True)
class MethodResult:
    """One method's results of every pair, in the order of the benchmark's pairs."""

    spec: MethodSpec
    rois: tuple[str, ...]
    pairs: tuple[PairResult, ...]

    def values(self, metric: str) -> np.ndarray:
        """(pairs, regions) of one metric; NaN where it has no value."""
        rows = [[pair.metrics[roi][metric] for roi in self.rois] for pair in self.pairs]
        return np.array(rows, dtype=float)

    def by_roi(self, metric: str) -> np.ndarray:
        """Mean over the pairs, (regions,); NaN for a region without values."""
        return np.array([_mean(column) for column in self.values(metric).T])

    def mean(self, metric: str = "cd-l1") -> float:
        """Mean over all pairs and regions that have a value; NaN if none has."""
        return _mean(self.values(metric).ravel())

    def by_confidence(self, metric: str = "cd-l1") -> tuple[float, float] | None:
        """Mean of the quarter of all regions that the method is surest of, and of the quarter that
        it is least sure of; None for a method without confidence."""
        if not all(pair.confidence for pair in self.pairs):
            return None
        sure = [[pair.confidence[roi] for roi in self.rois] for pair in self.pairs]
        order = np.argsort(-np.array(sure), axis=None, kind="stable")
        values = self.values(metric).ravel()[order]
        quarter = max(1, len(values) // 4)
        return _mean(values[:quarter]), _mean(values[-quarter:])

    @property
    def seconds(self) -> np.ndarray:
        """Wall time of each pair, (pairs,)."""
        return np.array([pair.seconds for pair in self.pairs])

    @property
    def missed(self) -> int:
        """How many regions were found nowhere, over all pairs."""
        return sum(not count for pair in self.pairs for count in pair.points.values())


@dataclass(frozen=True)
class _Task:
    spec: MethodSpec
    category: str
    reference: BenchmarkObject
    target: BenchmarkObject


def evaluate(
    benchmark: Benchmark,
    specs: Sequence[MethodSpec],
    workers: Workers = 1,
    cache: PairCache | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[MethodResult]:
    """Run methods on all ordered pairs, on `workers` processes of one thread each.

    With one worker everything runs in this process. Pairs that `cache` has are not run again, and
    each one that is done is added to it. `progress` is told (method, pairs done, all). Raises
    whatever a method raises, and DataError for a pair whose processes die.
    """
    done: dict[tuple[str, str, str], PairResult] = {}
    tasks = []
    for spec in specs:
        cached = cache.open(benchmark, spec) if cache else {}
        for reference, target in benchmark.pairs:
            names = (reference.name, target.name)
            if names in cached:
                done[spec.name, reference.name, target.name] = cached[names]
            else:
                tasks.append(_Task(spec, benchmark.category, reference, target))
    total = len(benchmark.pairs)
    counts = {spec.name: sum(key[0] == spec.name for key in done) for spec in specs}
    tell = progress or (lambda *_: None)
    for name, count in counts.items():
        tell(name, count, total)
    with closing(run_tasks(_run, tasks, workers)) as results:
        for task, result in results:
            if isinstance(result, Exception):
                raise _explained(task, result)
            if cache:
                cache.add(benchmark, task.spec, result)
            done[task.spec.name, result.reference, result.target] = result
            counts[task.spec.name] += 1
            tell(task.spec.name, counts[task.spec.name], total)
    return [
        MethodResult(
            spec,
            benchmark.rois,
            tuple(done[spec.name, reference.name, target.name] for reference, target in pairs),
        )
        for spec in specs
        for pairs in [benchmark.pairs]
    ]


def run_pair(
    match: Method, category: str, reference: BenchmarkObject, target: BenchmarkObject
) -> PairResult:
    """Find a reference's regions on a target and score them. Timed is the one call of `match`."""
    start = time.perf_counter()
    found = match(reference.cloud, reference.regions, target.cloud)
    seconds = time.perf_counter() - start
    metrics = {roi: score(found[roi], target, roi, category) for roi in reference.regions}
    points = {roi: len(found[roi]) for roi in reference.regions}
    confidence = dict(getattr(match, "confidence", {}))
    return PairResult(reference.name, target.name, seconds, points, metrics, confidence)


def _run(task: _Task) -> PairResult:
    return run_pair(
        build_method(task.spec), task.category, _known(task.reference), _known(task.target)
    )


@lru_cache(maxsize=32)
def _known(item: BenchmarkObject) -> BenchmarkObject:
    """The first copy of an object that this process was sent, for methods to recognise it by."""
    return item


def _explained(task: _Task, error: Exception) -> Exception:
    if not isinstance(error, TaskLost):
        return error
    pair = f"{task.reference.name} to {task.target.name}"
    return DataError(f"{task.spec.name}, {pair}: {error}; give fewer --workers")


def _mean(values: np.ndarray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else float("nan")
