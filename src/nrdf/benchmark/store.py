"""Figures of finished pairs on disk, so that an interrupted evaluation goes on where it was."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from nrdf.benchmark import metrics
from nrdf.benchmark.bsrc import Benchmark, BenchmarkObject
from nrdf.benchmark.methods import MethodSpec
from nrdf.errors import OutputError
from nrdf.ply import write_atomically

log = logging.getLogger(__name__)

FOLDER = "pairs"
_PACKAGE = Path(__file__).resolve().parents[1]
_SOURCES = (
    "benchmark/baselines.py", "benchmark/bsrc.py", "benchmark/learned.py", "benchmark/methods.py",
    "benchmark/metrics.py", "benchmark/ndf.py", "cloud.py", "field/*.py", "geometry.py",
    "regions/*.py", "shapes/registration.py",
)  # fmt: skip
"""What figures depend on, beside the data and the weights."""


@dataclass(frozen=True)
class PairResult:
    """One method on one pair.

    seconds: wall time of the call; points: how many were found, by region; figures: each metric
    (`nrdf.benchmark.metrics.METRICS`) by region, None where it has no value; confidence: the
    method's own, by region, empty where it has none.
    """

    reference: str
    target: str
    seconds: float
    points: dict[str, int]
    figures: dict[str, dict[str, float | None]]
    confidence: dict[str, float]


class PairStore:
    """A folder of `pairs/<category>-<labels>-<method>.jsonl`, one line a pair.

    A line counts only if its fingerprint fits: of the method, its weights, the labels, both
    objects' files, and the code that figures depend on. With `overwrite` none counts. Raises
    OutputError where the folder cannot be made or written.
    """

    def __init__(self, folder: Path, overwrite: bool = False) -> None:
        self.folder, self.overwrite = folder / FOLDER, overwrite
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot make {self.folder}: {error.strerror or error}; choose another --out"
            ) from error

    def open(self, benchmark: Benchmark, spec: MethodSpec) -> dict[tuple[str, str], PairResult]:
        """The pairs of a method that are there, by (reference, target); others are taken out."""
        path = self._path(benchmark, spec)
        kept = {} if self.overwrite else self._read(path, benchmark, spec)
        lines = [_line(*item) for item in kept.values()]
        if path.exists() or lines:
            write_atomically(path, [line.encode("utf-8") for line in lines])
        if kept:
            count, total = len(kept), len(benchmark.pairs)
            log.info("%s: %d of %d pairs were there already", spec.name, count, total)
        return {names: result for names, (_, result) in kept.items()}

    def add(self, benchmark: Benchmark, spec: MethodSpec, result: PairResult) -> None:
        """Append one pair."""
        items = {item.name: item for item in benchmark.objects}
        mark = fingerprint(benchmark, spec, items[result.reference], items[result.target])
        path = self._path(benchmark, spec)
        try:
            with open(path, "a", encoding="utf-8") as file:
                file.write(_line(mark, result))
        except OSError as error:
            raise OutputError(f"cannot write {path}: {error.strerror or error}") from error

    def _path(self, benchmark: Benchmark, spec: MethodSpec) -> Path:
        return self.folder / f"{benchmark.category}-{benchmark.labels}-{spec.name}.jsonl"

    def _read(
        self, path: Path, benchmark: Benchmark, spec: MethodSpec
    ) -> dict[tuple[str, str], tuple[str, PairResult]]:
        marks = {
            fingerprint(benchmark, spec, reference, target): (reference.name, target.name)
            for reference, target in benchmark.pairs
        }
        kept = {}
        try:
            lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        except (OSError, ValueError) as error:
            raise OutputError(f"cannot read {path}: {error}; delete it to start anew") from None
        for line in lines:
            mark, result = _parsed(line, benchmark.rois)
            if mark in marks and result is not None:
                kept[marks[mark]] = (mark, result)
        return kept


def fingerprint(
    benchmark: Benchmark, spec: MethodSpec, reference: BenchmarkObject, target: BenchmarkObject
) -> str:
    """What a pair's figures depend on, as 32 hexadecimal digits."""
    parts = [
        spec.name, spec.sha256, benchmark.category, benchmark.labels, reference.checksum,
        target.checksum, metrics.VERSION, code_checksum(),
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


@cache
def code_checksum() -> str:
    """SHA-256 of the source files that figures depend on."""
    digest = hashlib.sha256()
    for pattern in _SOURCES:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def _line(mark: str, result: PairResult) -> str:
    return json.dumps({"fingerprint": mark, **asdict(result)}) + "\n"


def _parsed(line: str, rois: tuple[str, ...]) -> tuple[str, PairResult | None]:
    """A line's fingerprint and result; ("", None) for one that was cut off or is not ours."""
    try:
        content: Mapping[str, Any] = json.loads(line)
        figures = {
            roi: {name: _number(content["figures"][roi][name]) for name in metrics.METRICS}
            for roi in rois
        }
        points = {roi: int(content["points"][roi]) for roi in rois}
        names = str(content["reference"]), str(content["target"])
        confidence = {roi: float(value) for roi, value in content["confidence"].items()}
        result = PairResult(*names, float(content["seconds"]), points, figures, confidence)
        return str(content["fingerprint"]), result
    except (ValueError, KeyError, TypeError, AttributeError):
        return "", None


def _number(value: Any) -> float | None:
    return None if value is None else float(value)
