"""What was measured on labelled objects: as a table, as Markdown, CSV and JSON.

Definitions: docs/benchmark.md.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from nrdf.benchmark.objects_match import PairFigure, PartFigure
from nrdf.benchmark.objects_pairs import ABSENT, HIDDEN, THERE
from nrdf.process.transfer import MIN_CONFIDENCE

RESAMPLES = 10_000
RIVALS = ("nrdf", "registration")


@dataclass(frozen=True)
class Count:
    """So many of so many."""

    number: int
    of: int

    def __str__(self) -> str:
        return f"{self.number / self.of:.0%} ({self.number} of {self.of})" if self.of else ""


@dataclass(frozen=True)
class Row:
    """One method on a set of pairs, in whole clouds or in scans.

    iou: by part, mean over the pairs that both have it, with their number; mean: over all of
    those. Of a method that tells absence, else None: told (present parts that were told absent or
    not observed), skipped (those, and present parts below `MIN_CONFIDENCE`), absent (absent parts
    that were skipped), hidden (parts not seen in the scan that were skipped).
    """

    set: str
    views: int
    method: str
    pairs: int
    iou: dict[str, tuple[float, int]]
    mean: float
    seconds: float
    told: Count | None
    skipped: Count | None
    absent: Count | None
    hidden: Count | None


def is_skipped(part: PartFigure) -> bool:
    """Whether a transfer would leave a part out: reported absent or not observed, or in doubt."""
    return bool(part.reason) or part.score is None or part.score < MIN_CONFIDENCE


def rows_of(
    figures: Sequence[PairFigure], sets: Mapping[str, Sequence[tuple[str, str]]]
) -> list[Row]:
    """A row a set, view and method; empty ones are left out. sets: name to pairs of objects."""
    views = dict.fromkeys(figure.views for figure in figures)
    methods = dict.fromkeys(figure.method for figure in figures)
    found = []
    for name, pairs in sets.items():
        chosen = {*pairs}
        mine = [f for f in figures if (f.reference, f.target) in chosen]
        for number in views:
            for method in methods:
                of = [f for f in mine if (f.views, f.method) == (number, method)]
                if of:
                    found.append(_row(name, number, method, of))
    return found


def _row(name: str, views: int, method: str, figures: Sequence[PairFigure]) -> Row:
    parts = [part for figure in figures for part in figure.parts]
    there, absent, hidden = (
        [part for part in parts if part.state == state] for state in (THERE, ABSENT, HIDDEN)
    )
    by_part: dict[str, list[float]] = {}
    for part in there:
        by_part.setdefault(part.part, []).append(part.iou or 0.0)
    tells = any(part.score is not None for part in parts)

    def count(asked: Sequence[PartFigure], yes: Sequence[bool]) -> Count | None:
        return Count(sum(yes), len(asked)) if tells else None

    return Row(
        set=name,
        views=views,
        method=method,
        pairs=len(figures),
        iou={part: (float(np.mean(values)), len(values)) for part, values in by_part.items()},
        mean=float(np.mean([part.iou or 0.0 for part in there])) if there else float("nan"),
        seconds=float(np.median([figure.seconds for figure in figures])),
        told=count(there, [bool(part.reason) for part in there]),
        skipped=count(there, [is_skipped(part) for part in there]),
        absent=count(absent, [is_skipped(part) for part in absent]),
        hidden=count(hidden, [is_skipped(part) for part in hidden]),
    )


def headings(parts: Sequence[str]) -> list[str]:
    """The columns after the method's."""
    return [
        *parts, "mean IoU", "s/pair", "present told absent", "present skipped", "absent told",
    ]  # fmt: skip


def cells(row: Row, parts: Sequence[str]) -> list[str]:
    """A row's texts for `headings`, empty where there is no value."""
    by_part = [f"{row.iou[part][0]:.3f}" if part in row.iou else "" for part in parts]
    counts = ["" if value is None else str(value) for value in (row.told, row.skipped, row.absent)]
    mean = "" if np.isnan(row.mean) else f"{row.mean:.3f}"
    return [*by_part, mean, f"{row.seconds:.2f}", *counts]


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


def to_csv(figures: Sequence[PairFigure]) -> str:
    """A line a method, pair and part."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([
        "method", "views", "reference", "target", "part", "state", "iou", "true_points",
        "found_points", "reason", "skipped", "score", "confidence", "observed", "evidence",
        "pose_error_deg", "seconds_a_pair",
    ])  # fmt: skip
    for figure in figures:
        pose = "" if figure.pose is None else f"{figure.pose.degrees:.3f}"
        for part in figure.parts:
            own = [part.iou, part.score, part.confidence, part.observed]
            iou, *told = ("" if value is None else f"{value:.6g}" for value in own)
            skipped = "" if part.score is None else str(is_skipped(part)).lower()
            writer.writerow([
                figure.method, figure.views, figure.reference, figure.target, part.part,
                part.state, iou, part.true, part.found, part.reason, skipped, *told,
                " ".join(f"{value:.6g}" for value in part.evidence), pose,
                f"{figure.seconds:.4f}",
            ])  # fmt: skip
    return text.getvalue()


def row_json(row: Row) -> dict[str, object]:
    """A row as JSON."""
    content = asdict(row)
    content["iou"] = {name: {"mean": m, "pairs": n} for name, (m, n) in row.iou.items()}
    return {k: None if isinstance(v, float) and np.isnan(v) else v for k, v in content.items()}
