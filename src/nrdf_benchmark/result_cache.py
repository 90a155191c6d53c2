"""Results of finished pairs on disk, so that an interrupted evaluation goes on where it was."""

from __future__ import annotations

import hashlib
import json
import logging
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from nrdf.errors import OutputError
from nrdf.io.atomic import output_errors, write_atomically
from nrdf.io.files import read_file
from nrdf.io.locks import remove_partial_files
from nrdf_benchmark import metrics
from nrdf_benchmark.bsrc.dataset import Benchmark, BenchmarkObject
from nrdf_benchmark.methods.registry import MethodSpec

log = logging.getLogger(__name__)
Key = TypeVar("Key")

FOLDER = "pairs"
_LARGEST = 1 << 30
_ROOT = Path(__file__).resolve().parents[1]
SOURCES = (
    "nrdf/field", "nrdf/geometry", "nrdf/io", "nrdf/regions", "nrdf/shapes",
    "nrdf_benchmark/bsrc/dataset.py", "nrdf_benchmark/methods", "nrdf_benchmark/presets",
    "nrdf_benchmark/metrics.py",
)  # fmt: skip
"""Folders and files of code that results depend on, beside the data and the weights."""


@dataclass(frozen=True)
class PairResult:
    """One method on one pair.

    seconds: wall time of the call; points: how many were found, by region; metrics: each metric
    (`nrdf_benchmark.metrics.METRICS`) by region, None where it has no value; confidence: the
    method's own, by region, empty where it has none.
    """

    reference: str
    target: str
    seconds: float
    points: dict[str, int]
    metrics: dict[str, dict[str, float | None]]
    confidence: dict[str, float]


class LineCache:
    """A folder `pairs` of files with one JSON object a line.

    A line counts only if its fingerprint is asked for; with `overwrite` none counts. Raises
    OutputError where the folder cannot be made or written.
    """

    def __init__(self, folder: Path, overwrite: bool = False) -> None:
        self.folder, self.overwrite = folder / FOLDER, overwrite
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            remove_partial_files(self.folder)
        except OSError as error:
            raise OutputError(
                f"cannot make {self.folder}: {error.strerror or error}; choose another --out"
            ) from error

    def read(self, name: str, marks: Mapping[str, Key]) -> dict[Key, dict[str, Any]]:
        """What the file `name` has of the fingerprints in `marks`, by what they stand for there;
        other lines are taken out."""
        path, cached = self.folder / name, {}
        there = path.exists() and not self.overwrite
        text = read_file(path, OutputError, _LARGEST) if there else b""
        for line in text.decode("utf-8", "replace").splitlines():
            try:
                content = json.loads(line)
                mark = content["fingerprint"]
            except (ValueError, KeyError, TypeError, RecursionError):
                continue  # cut off, or not ours
            if isinstance(mark, str) and mark in marks:
                cached[marks[mark]] = content
        if path.exists():
            write_atomically(path, [f"{json.dumps(line)}\n".encode() for line in cached.values()])
        return cached

    def append(self, name: str, mark: str, content: Mapping[str, Any]) -> None:
        """Add a line."""
        path = self.folder / name
        with output_errors(path), open(path, "a", encoding="utf-8") as file:
            file.write(json.dumps({"fingerprint": mark, **content}) + "\n")


class PairCache(LineCache):
    """A folder of `pairs/<category>-<labels>-<method>.jsonl`, one line a pair.

    A line counts only if its fingerprint fits: of the method, its weights, the labels, both
    objects' files, and the code that results depend on.
    """

    def open(self, benchmark: Benchmark, spec: MethodSpec) -> dict[tuple[str, str], PairResult]:
        """The pairs of a method that are there, by (reference, target); others are taken out."""
        marks = {
            fingerprint(benchmark, spec, reference, target): (reference.name, target.name)
            for reference, target in benchmark.pairs
        }
        lines = self.read(_file(benchmark, spec), marks)
        parsed = {names: _parsed(line, benchmark.rois) for names, line in lines.items()}
        cached = {names: result for names, result in parsed.items() if result is not None}
        if cached:
            count, total = len(cached), len(benchmark.pairs)
            log.info("%s: %d of %d pairs were there already", spec.name, count, total)
        return cached

    def add(self, benchmark: Benchmark, spec: MethodSpec, result: PairResult) -> None:
        """Append one pair."""
        items = {item.name: item for item in benchmark.objects}
        mark = fingerprint(benchmark, spec, items[result.reference], items[result.target])
        self.append(_file(benchmark, spec), mark, asdict(result))


def fingerprint(
    benchmark: Benchmark, spec: MethodSpec, reference: BenchmarkObject, target: BenchmarkObject
) -> str:
    """What a pair's results depend on, as 32 hexadecimal digits."""
    parts = [
        spec.name, spec.sha256, benchmark.category, benchmark.labels, reference.checksum,
        target.checksum, metrics.VERSION, code_checksum(),
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


@cache
def code_checksum(sources: tuple[str, ...] = SOURCES) -> str:
    """SHA-256 of the Python files in folders of code (or single files) that results depend on.

    Paths are relative to the folder that holds the packages. Raises FileNotFoundError for one
    that is not there: results would be cached whatever becomes of that code.
    """
    digest = hashlib.sha256()
    for source in sources:
        place = _ROOT / source
        files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
        for path in files:
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _file(benchmark: Benchmark, spec: MethodSpec) -> str:
    return f"{benchmark.category}-{benchmark.labels}-{spec.name}.jsonl"


def _parsed(content: Mapping[str, Any], rois: tuple[str, ...]) -> PairResult | None:
    """A line's result; None for one that is not ours."""
    try:
        values = {
            roi: {name: _number(content["metrics"][roi][name]) for name in metrics.METRICS}
            for roi in rois
        }
        points = {roi: int(content["points"][roi]) for roi in rois}
        names = str(content["reference"]), str(content["target"])
        confidence = {roi: _finite(value) for roi, value in content["confidence"].items()}
        return PairResult(*names, _finite(content["seconds"]), points, values, confidence)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError):
        return None


def _number(value: Any) -> float | None:
    return None if value is None else _finite(value)


def _finite(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("a metric that is no number")
    return number
