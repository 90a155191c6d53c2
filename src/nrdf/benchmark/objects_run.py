"""Every method on every pair of labelled objects, in processes, going on where it was."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from nrdf.benchmark import store
from nrdf.benchmark.methods import MethodSpec
from nrdf.benchmark.objects import LABELS, LabelledMesh
from nrdf.benchmark.objects_match import (
    WHOLE,
    PairFigure,
    PartFigure,
    Pose,
    Settings,
    finder,
)
from nrdf.benchmark.store import LineStore
from nrdf.errors import DataError, NrdfError
from nrdf.shapes.pool import CRASHED, each

log = logging.getLogger(__name__)

_SOURCES = (
    "benchmark/baselines.py", "benchmark/learned.py", "benchmark/methods.py",
    "benchmark/objects.py", "benchmark/objects_match.py", "benchmark/objects_pairs.py",
    "benchmark/objects_sample.py", "benchmark/scans.py", "cloud.py", "field/*.py", "geometry.py",
    "mesh.py", "regions/*.py", "scans/*.py", "shapes/registration.py",
)  # fmt: skip
"""What figures depend on, beside the data and the weights."""


@dataclass(frozen=True)
class _Task:
    settings: Settings
    spec: MethodSpec
    views: int
    reference: str
    target: str


def pairs_of(objects: Sequence[LabelledMesh], categories: Sequence[str]) -> list[tuple[str, str]]:
    """All ordered pairs of different objects of some categories, as keys."""
    keys = [item.key for item in objects if item.category in categories]
    return [(reference, target) for reference in keys for target in keys if reference != target]


def evaluate_objects(
    settings: Settings,
    objects: Sequence[LabelledMesh],
    pairs: Sequence[tuple[str, str]],
    specs: Sequence[MethodSpec],
    views: Sequence[int] = (WHOLE,),
    workers: int = 1,
    kept: LineStore | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[PairFigure]:
    """Run methods on pairs of objects, whole and in scans, on `workers` processes of one thread.

    Pairs that `kept` has are not run again, and each one that is done is added to it. `progress` is
    told (method, done, all). Raises whatever a method raises, and DataError if a process dies.
    """
    tell = progress or (lambda *_: None)
    checksums = {item.key: item.checksum for item in objects}
    total = len(pairs) * len(views)
    tasks: list[_Task] = []
    done: dict[_Task, PairFigure] = {}
    marks: dict[_Task, str] = {}
    counts = dict.fromkeys((spec.name for spec in specs), 0)
    for spec in specs:
        for number in views:
            mine = [_Task(settings, spec, number, *pair) for pair in pairs]
            marks |= {task: _fingerprint(task, checksums) for task in mine}
            lines = kept.read(_file(mine[0]), {marks[t]: t for t in mine}) if kept and mine else {}
            found = {task: parsed for task, line in lines.items() if (parsed := _parsed(line))}
            done |= found
            counts[spec.name] += len(found)
            tasks += [task for task in mine if task not in found]
        if counts[spec.name]:
            log.info("%s: %d of %d pairs were there already", spec.name, counts[spec.name], total)
        tell(spec.name, counts[spec.name], total)
    with closing(each(_run, tasks, min(workers, len(tasks)))) as results:
        for task, result in results:
            if isinstance(result, Exception):
                raise _explained(task, result)
            if kept:
                kept.append(_file(task), marks[task], asdict(result))
            done[task] = result
            counts[task.spec.name] += 1
            tell(task.spec.name, counts[task.spec.name], total)
    return [done[task] for task in marks]


def _run(task: _Task) -> PairFigure:
    return finder(task.settings).run(task.spec, task.views, task.reference, task.target)


def _file(task: _Task) -> str:
    return f"objects-{task.views}-{task.spec.name}.jsonl"


def _fingerprint(task: _Task, checksums: dict[str, str]) -> str:
    """What a pair's figures depend on, as 32 hexadecimal digits."""
    settings = task.settings
    parts = [
        task.spec.name, task.spec.sha256, _digest(settings), settings.points, settings.normals,
        task.views, task.reference, task.target, checksums[task.reference],
        checksums[task.target], store.code_checksum(_SOURCES),
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


@cache
def _digest(settings: Settings) -> str:
    """Of the names of the labels, and of the model that aligns."""
    files = (settings.folder / LABELS, settings.model)
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()


def _parsed(content: dict[str, Any]) -> PairFigure | None:
    """A line's figures; None for one that is not ours."""
    content.pop("fingerprint", None)
    try:
        figure = PairFigure(**content)
        parts = tuple(
            PartFigure(**{**part, "evidence": tuple(part["evidence"])}) for part in content["parts"]
        )
        pose = None if figure.pose is None else Pose(**content["pose"])
        return replace(figure, parts=parts, pose=pose)
    except (TypeError, KeyError, ValueError):
        return None


def _explained(task: _Task, error: Exception) -> Exception:
    pair = f"{task.spec.name}, {task.reference} to {task.target}"
    if isinstance(error, NrdfError):
        return DataError(f"{pair}: {error}")
    if str(error) == CRASHED:
        return DataError(f"{pair}: {CRASHED}; give fewer --workers")
    return error
