"""Every method on every pair of labelled objects, in processes, going on where it was."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any, TypeVar

from nrdf.errors import DataError, NrdfError
from nrdf.tasks import TaskLost, Workers, run_tasks
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.objects.dataset import LABELS, LabelledMesh
from nrdf_benchmark.objects.jobs import JobResult, run_job
from nrdf_benchmark.objects.retrieval import (
    WHOLE,
    ObjectPairResult,
    PartResult,
    Pose,
    Settings,
    shared_retrieval,
)
from nrdf_benchmark.result_cache import SOURCES, LineCache, code_checksum

log = logging.getLogger(__name__)
Result = TypeVar("Result", ObjectPairResult, JobResult)
Progress = Callable[[str, int, int], None]

JOBS = "jobs"
"""What `progress` and files call the pairs that go all the way to robot programs."""
_SOURCES = (
    *SOURCES, "nrdf/scans", "nrdf_benchmark/scans.py", "nrdf_benchmark/objects/dataset.py",
    "nrdf_benchmark/objects/sampling.py", "nrdf_benchmark/objects/pairs.py",
    "nrdf_benchmark/objects/retrieval.py",
)  # fmt: skip
"""Code that results depend on, beside the data and the weights."""
_JOB_SOURCES = (
    *_SOURCES, "nrdf_benchmark/objects/jobs.py", "nrdf/export", "nrdf/process", "nrdf/reports",
    "nrdf/surface", "nrdf/toolpath",
)  # fmt: skip


@dataclass(frozen=True)
class _Task:
    """spec: None for a job."""

    settings: Settings
    reference: str
    target: str
    spec: MethodSpec | None = None
    views: int = WHOLE

    @property
    def name(self) -> str:
        return JOBS if self.spec is None else self.spec.name

    @property
    def file(self) -> str:
        return f"objects-{self.views}-{self.name}.jsonl"


def pairs_of(objects: Sequence[LabelledMesh], categories: Sequence[str]) -> list[tuple[str, str]]:
    """All ordered pairs of different objects of some categories, as keys."""
    keys = [item.key for item in objects if item.entry.category in categories]
    return [(reference, target) for reference in keys for target in keys if reference != target]


def evaluate_objects(
    settings: Settings,
    objects: Sequence[LabelledMesh],
    pairs: Sequence[tuple[str, str]],
    specs: Sequence[MethodSpec],
    views: Sequence[int] = (WHOLE,),
    workers: Workers = 1,
    cache: LineCache | None = None,
    progress: Progress | None = None,
) -> list[ObjectPairResult]:
    """Run methods on pairs of objects, whole and in scans, on `workers` processes of one thread.

    Pairs that `cache` has are not run again; each one that is done is added to it. `progress` is
    told (method, done, all). Raises whatever a method raises, and DataError if a process dies.
    """
    tasks = [
        _Task(settings, *pair, spec, number) for spec in specs for number in views for pair in pairs
    ]
    return _resumed(tasks, _run, _parse_pair, _SOURCES, objects, workers, cache, progress)


def evaluate_jobs(
    settings: Settings,
    objects: Sequence[LabelledMesh],
    pairs: Sequence[tuple[str, str]],
    workers: Workers = 1,
    cache: LineCache | None = None,
    progress: Progress | None = None,
) -> list[JobResult]:
    """Every pair from a file to robot programs; all else as of `evaluate_objects`."""
    tasks = [_Task(settings, *pair) for pair in pairs]
    return _resumed(tasks, _run_job, _parse_job, _JOB_SOURCES, objects, workers, cache, progress)


def _resumed(
    tasks: Sequence[_Task],
    run: Callable[[_Task], Result],
    parse: Callable[[dict[str, Any]], Result | None],
    sources: tuple[str, ...],
    objects: Sequence[LabelledMesh],
    workers: Workers,
    cache: LineCache | None,
    progress: Progress | None,
) -> list[Result]:
    """What `run` gives of each task, or what the cache has of it."""
    tell = progress or (lambda *_: None)
    checksums = {item.key: item.checksum for item in objects}
    marks = {task: _fingerprint(task, checksums, sources) for task in tasks}
    done: dict[_Task, Result] = {}
    for file in dict.fromkeys(task.file for task in tasks):
        wanted = {marks[task]: task for task in tasks if task.file == file}
        lines = cache.read(file, wanted) if cache else {}
        done |= {task: read for task, line in lines.items() if (read := parse(line))}
    totals, counts = (
        {name: sum(task.name == name for task in of) for name in {task.name for task in tasks}}
        for of in (tasks, done)
    )
    for name, count in counts.items():
        if count:
            log.info("%s: %d of %d pairs were there already", name, count, totals[name])
        tell(name, count, totals[name])
    todo = [task for task in tasks if task not in done]
    with closing(run_tasks(run, todo, workers)) as results:
        for task, result in results:
            if isinstance(result, Exception):
                raise _explained(task, result)
            if cache:
                cache.append(task.file, marks[task], asdict(result))
            done[task] = result
            counts[task.name] += 1
            tell(task.name, counts[task.name], totals[task.name])
    return [done[task] for task in tasks]


def _run(task: _Task) -> ObjectPairResult:
    assert task.spec is not None
    return shared_retrieval(task.settings).run(task.spec, task.views, task.reference, task.target)


def _run_job(task: _Task) -> JobResult:
    return run_job(task.settings, task.reference, task.target)


def _fingerprint(task: _Task, checksums: Mapping[str, str], sources: tuple[str, ...]) -> str:
    """What a pair's results depend on, as 32 hexadecimal digits."""
    settings = task.settings
    parts = [
        task.name, task.spec and task.spec.sha256, _digest(settings), settings.points,
        settings.normals, task.views, task.reference, task.target, checksums[task.reference],
        checksums[task.target], code_checksum(sources),
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


@cache
def _digest(settings: Settings) -> str:
    """Of the names of the labels, and of the model that aligns."""
    files = (settings.folder / LABELS, settings.model)
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _parse_pair(content: dict[str, Any]) -> ObjectPairResult | None:
    """A line's results; None for one that is not ours."""
    content.pop("fingerprint", None)
    try:
        result = ObjectPairResult(**content)
        parts = tuple(
            PartResult(**{**part, "evidence": tuple(part["evidence"])}) for part in content["parts"]
        )
        pose = None if result.pose is None else Pose(**content["pose"])
        return replace(result, parts=parts, mixed=tuple(content["mixed"]), pose=pose)
    except (TypeError, KeyError, ValueError):
        return None


def _parse_job(content: dict[str, Any]) -> JobResult | None:
    content.pop("fingerprint", None)
    try:
        return replace(JobResult(**content), reasons=tuple(content["reasons"]))
    except (TypeError, KeyError):
        return None


def _explained(task: _Task, error: Exception) -> Exception:
    pair = f"{task.name}, {task.reference} to {task.target}"
    hint = "; give fewer --workers" if isinstance(error, TaskLost) else ""
    return DataError(f"{pair}: {error}{hint}") if isinstance(error, NrdfError) else error
