"""What was measured on labelled objects, in rows: of the table, and of every pair and part.

Definitions: docs/evidence/objects.md.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.io.file_names import spreadsheet_text
from nrdf.process.transfer_result import MIN_CONFIDENCE
from nrdf_benchmark.objects.pairs import ABSENT, HIDDEN, LEAST_SHARE, THERE
from nrdf_benchmark.objects.retrieval import ObjectPairResult, PartResult, Pose

Pairs = Sequence[tuple[str, str]]
_RESAMPLES = 10_000
_LEAST_TARGETS = 5  # of an interval; fewer say nothing about others
_RIGHT = 5.0  # degrees within which a pose is right


@dataclass(frozen=True)
class Count:
    """So many of so many."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number / self.of:.0%} ({self.number}/{self.of})" if self.of else ""


@dataclass(frozen=True)
class Row:
    """One method on a set of pairs, in whole clouds or in scans.

    iou: by part, mean over the pairs that both have it, with their number; mean: over all of
    those; plain: over those whose reference has no mixed pieces, so that each part is a region as
    a whole. Of a method that tells absence, else None: told (present parts that were reported
    absent or not observed), skipped (those, and present parts below `MIN_CONFIDENCE`), absent
    (absent parts that were skipped), hidden (parts not seen in the scan that were skipped).
    """

    set: str
    views: int
    method: str
    pairs: int
    iou: dict[str, tuple[float, int]]
    mean: float
    plain: float
    seconds: float
    told: Count | None
    skipped: Count | None
    absent: Count | None
    hidden: Count | None


@dataclass(frozen=True)
class Difference:
    """Mean part IoU of one method less another's, over the parts of a set's pairs; low, high: 95 %
    interval, targets drawn anew with all of their pairs."""

    set: str
    views: int
    one: str
    other: str
    mean: float
    low: float
    high: float
    targets: int


@dataclass(frozen=True)
class Poses:
    """Alignments of a set's targets. right: within 5 degrees, of those whose front is known;
    warned: wrong ones with a warning; scale: median relative error; seconds: median."""

    set: str
    views: int
    right: Count
    warned: Count
    scale: float
    seconds: float


def is_skipped(part: PartResult) -> bool:
    """Whether a transfer would leave a part out: reported absent or not observed, or in doubt."""
    return bool(part.reason) or part.score is None or part.score < MIN_CONFIDENCE


def rows_of(results: Sequence[ObjectPairResult], sets: Mapping[str, Pairs]) -> list[Row]:
    """A row a set, view and method; empty ones are left out. sets: name to pairs of objects."""
    views = dict.fromkeys(result.views for result in results)
    methods = dict.fromkeys(result.method for result in results)
    found = []
    for name, pairs in sets.items():
        mine = select(results, pairs)
        for number in views:
            for method in methods:
                of = [f for f in mine if (f.views, f.method) == (number, method)]
                if of:
                    found.append(_row(name, number, method, of))
    return found


def _row(name: str, views: int, method: str, results: Sequence[ObjectPairResult]) -> Row:
    parts = [part for result in results for part in result.parts]
    there, absent, hidden = (
        [part for part in parts if part.state == state] for state in (THERE, ABSENT, HIDDEN)
    )
    by_part: dict[str, list[float]] = {}
    for part in there:
        by_part.setdefault(part.part, []).append(part.iou or 0.0)
    tells = any(part.score is not None for part in parts)

    def count(asked: Sequence[PartResult], yes: Sequence[bool]) -> Count | None:
        return Count(sum(yes), len(asked)) if tells else None

    return Row(
        set=name,
        views=views,
        method=method,
        pairs=len(results),
        iou={part: (float(np.mean(values)), len(values)) for part, values in by_part.items()},
        mean=_mean(there),
        plain=_mean([p for f in results if f.mixed[0] < LEAST_SHARE for p in f.parts]),
        seconds=float(np.median([result.seconds for result in results])),
        told=count(there, [bool(part.reason) for part in there]),
        skipped=count(there, [is_skipped(part) for part in there]),
        absent=count(absent, [is_skipped(part) for part in absent]),
        hidden=count(hidden, [is_skipped(part) for part in hidden]),
    )


def _mean(parts: Sequence[PartResult]) -> float:
    values = [part.iou or 0.0 for part in parts if part.state == THERE]
    return float(np.mean(values)) if values else float("nan")


def difference_of(
    results: Sequence[ObjectPairResult], of: Row, one: str = "nrdf", other: str = "registration"
) -> Difference | None:
    """How much better one method is than another on a set's results; None unless both were run, on
    five targets or more."""
    iou: dict[str, dict[tuple[str, str, str], float]] = {one: {}, other: {}}
    for result in results:
        if result.views == of.views and result.method in iou:
            for part in result.parts:
                if part.state == THERE:
                    key = result.reference, result.target, part.part
                    iou[result.method][key] = part.iou or 0.0
    targets = list(dict.fromkeys(target for _, target, _ in iou[one]))
    if iou[one].keys() != iou[other].keys() or len(targets) < _LEAST_TARGETS:
        return None
    number = {target: i for i, target in enumerate(targets)}
    which = np.array([number[target] for _, target, _ in iou[one]])
    better = np.array([iou[one][key] - iou[other][key] for key in iou[one]])
    sums, counts = np.bincount(which, better), np.bincount(which)
    drawn = np.random.default_rng(0).integers(0, len(targets), (_RESAMPLES, len(targets)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return Difference(
        of.set, of.views, one, other, float(better.mean()), float(low), float(high), len(targets)
    )


def poses_of(results: Sequence[ObjectPairResult], of: Row) -> Poses | None:
    """How well the targets of a set's scans were aligned; None of whole clouds."""
    poses: dict[str, Pose] = {
        result.target: result.pose
        for result in results
        if result.views == of.views and result.pose is not None
    }
    if not poses:
        return None
    known = [pose for pose in poses.values() if pose.degrees is not None]
    wrong = [pose for pose in known if (pose.degrees or 0.0) >= _RIGHT]
    return Poses(
        of.set,
        of.views,
        Count(len(known) - len(wrong), len(known)),
        Count(sum(pose.warned for pose in wrong), len(wrong)),
        float(np.median([pose.scale for pose in poses.values()])),
        float(np.median([pose.seconds for pose in poses.values()])),
    )


def select(results: Sequence[ObjectPairResult], pairs: Pairs) -> list[ObjectPairResult]:
    """The results of a set's pairs."""
    chosen = {*pairs}
    return [result for result in results if (result.reference, result.target) in chosen]


def headings(parts: Sequence[str]) -> list[str]:
    """The columns after the method's."""
    return [*parts, "mean", "plain", "s", "told absent", "skipped", "absent told"]


def cells(row: Row, parts: Sequence[str], brief: bool = False) -> list[str]:
    """A row's texts for `headings`, empty where there is no value. brief: to fit a terminal, parts
    with two digits and shares without the counts behind them."""
    digits = 2 if brief else 3
    by_part = [f"{row.iou[part][0]:.{digits}f}" if part in row.iou else "" for part in parts]
    means = ["" if np.isnan(value) else f"{value:.3f}" for value in (row.mean, row.plain)]
    counts = ["" if value is None else str(value) for value in (row.told, row.skipped, row.absent)]
    if brief:
        counts = [text.partition(" ")[0] for text in counts]
    return [*by_part, *means, f"{row.seconds:.2f}", *counts]


def caption(row: Row) -> str:
    """What a table of rows of one set and view is of."""
    seen = "whole clouds" if not row.views else f"scans of {row.views} view" + "s" * (row.views > 1)
    return f"{row.set.replace('+', ', ')}: {row.pairs} ordered pairs, {seen}"


def tables(rows: Sequence[Row]) -> Iterator[tuple[str, list[str], list[Row]]]:
    """Tables of rows that belong together: caption, parts and rows."""
    for key in dict.fromkeys((row.set, row.views) for row in rows):
        mine = [row for row in rows if (row.set, row.views) == key]
        parts = list(dict.fromkeys(part for row in mine for part in row.iou))
        yield caption(mine[0]), parts, mine


def to_csv(results: Sequence[ObjectPairResult]) -> str:
    """A line a method, pair and part."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([
        "method", "views", "reference", "target", "part", "state", "iou", "true_points",
        "found_points", "reason", "skipped", "score", "confidence", "observed", "evidence",
        "reference_mixed", "target_mixed", "pose_error_deg", "seconds_a_pair",
    ])  # fmt: skip
    for result in results:
        degrees = None if result.pose is None else result.pose.degrees
        pose = "" if degrees is None else f"{degrees:.3f}"
        for part in result.parts:
            own = [part.iou, part.score, part.confidence, part.observed]
            iou, *told = ("" if value is None else f"{value:.6g}" for value in own)
            skipped = "" if part.score is None else str(is_skipped(part)).lower()
            writer.writerow([
                result.method, result.views,
                *map(spreadsheet_text, (result.reference, result.target, part.part)),
                part.state, iou, part.true, part.found, part.reason, skipped, *told,
                " ".join(f"{value:.6g}" for value in part.evidence),
                *(f"{share:.4f}" for share in result.mixed), pose,
                f"{result.seconds:.4f}",
            ])  # fmt: skip
    return text.getvalue()
