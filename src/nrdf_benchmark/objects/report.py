"""The files of an evaluation on labelled objects: Markdown, CSV, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.io.atomic import write_atomically
from nrdf.process.transfer_result import MIN_CONFIDENCE
from nrdf_benchmark.methods.registry import METHODS
from nrdf_benchmark.objects.jobs import JobResult, describe_jobs
from nrdf_benchmark.objects.pairs import LEAST_SHARE
from nrdf_benchmark.objects.retrieval import ObjectPairResult
from nrdf_benchmark.objects.table import (
    Difference,
    Pairs,
    Poses,
    cells,
    difference_of,
    headings,
    poses_of,
    rows_of,
    select,
    tables,
    to_csv,
)
from nrdf_benchmark.scans import LEAST

STEM = "objects"


@dataclass(frozen=True)
class Report:
    """Results of every method and pair, the sets of pairs that they are summed up by, and jobs."""

    results: Sequence[ObjectPairResult]
    sets: Mapping[str, Pairs]
    jobs: Sequence[JobResult] = ()
    origin: Mapping[str, Any] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """Lines below the tables: differences with their intervals, poses, jobs."""
        said = []
        for difference in self.differences:
            said.append(
                f"{_where(difference)}: {difference.one} less {difference.other} "
                f"{difference.mean:+.3f} mean part IoU (95 %: {difference.low:+.3f} to "
                f"{difference.high:+.3f}, {difference.targets} targets drawn anew)"
            )
        for poses in self.poses:
            text = f"{_where(poses)}: "
            if poses.right.of:
                text += f"poses within 5°: {poses.right}; "
            if poses.warned.of:
                text += f"wrong ones with a warning: {poses.warned}; "
            said.append(f"{text}scale {poses.scale:.1%} off, {poses.seconds:.1f} s (medians)")
        return [*said, *describe_jobs(self.jobs)]

    @property
    def differences(self) -> list[Difference]:
        """Of `nrdf` and `registration`, for each set and view where both were run."""
        found = [difference_of(select(self.results, self.sets[r.set]), r) for r in self._firsts]
        return [difference for difference in found if difference is not None]

    @property
    def poses(self) -> list[Poses]:
        """Of scans, for each set and view."""
        found = [poses_of(select(self.results, self.sets[r.set]), r) for r in self._firsts]
        return [poses for poses in found if poses is not None]

    @property
    def _firsts(self) -> list:
        return [rows[0] for _, _, rows in tables(rows_of(self.results, self.sets))]

    def markdown(self) -> str:
        """The tables, the lines below them, and what the columns are."""
        lines = ["# Parts of real objects, each shown once", ""]
        for title, parts, rows in tables(rows_of(self.results, self.sets)):
            lines += [f"## {title}", "", _line(["", *headings(parts)])]
            lines.append("|---" * (len(headings(parts)) + 1) + "|")
            for row in rows:
                name = f"`{row.method}`: {METHODS[row.method].description}"
                lines.append(_line([name, *cells(row, parts)]))
            lines.append("")
        lines += [f"- {text}" for text in self.lines()]
        lines += ["", *EXPLANATION]
        return "\n".join(lines) + "\n"

    def to_json(self) -> dict[str, Any]:
        """Everything."""
        rows = [asdict(row) for row in rows_of(self.results, self.sets)]
        for row in rows:
            row["iou"] = {part: {"mean": m, "pairs": n} for part, (m, n) in row["iou"].items()}
            row |= {key: None for key in ("mean", "plain") if np.isnan(row[key])}
        return {
            **self.origin,
            "min_confidence": MIN_CONFIDENCE,
            "least_points": LEAST,
            "least_share": LEAST_SHARE,
            "sets": {name: list(pairs) for name, pairs in self.sets.items()},
            "rows": rows,
            "differences": [asdict(difference) for difference in self.differences],
            "poses": [asdict(poses) for poses in self.poses],
            "jobs": [asdict(job) for job in self.jobs],
            "pairs": [asdict(result) for result in self.results],
        }

    def write(self, folder: Path) -> list[Path]:
        """Write `objects.md`, `.csv` and `.json` into an existing folder; their paths.

        Each file is whole or as it was. Raises OutputError.
        """
        texts = {
            ".md": self.markdown(),
            ".csv": to_csv(self.results),
            ".json": json.dumps(self.to_json(), indent=1, ensure_ascii=False) + "\n",
        }
        paths = []
        for ending, text in texts.items():
            paths.append(folder / f"{STEM}{ending}")
            write_atomically(paths[-1], [text.encode("utf-8")])
        return paths


EXPLANATION = (
    "Columns of parts: intersection over union of the points found and the points that carry the "
    "label, mean over the ordered pairs of which both have the part; a part returned empty counts "
    "as 0. Points of the target's pieces that serve two functions (`mixed`) are left out.",
    "",
    "Mean: over all those pairs and parts. Plain: the same where the reference has no mixed "
    "pieces; from one that has, only some of a part is a region (the front legs, where the rear "
    "ones go on as the back's posts).",
    "",
    "Told absent: parts that the target has and shows, reported absent or not observed. "
    f"Skipped: those, and parts found with less mean confidence than {MIN_CONFIDENCE:g}, "
    "which a transfer leaves out. Absent told: parts that the target lacks, left out in one of "
    "these ways; counted only where the target has no mixed pieces.",
    "",
    "s: median seconds of finding all parts, both objects' normals and embeddings known.",
)


def _where(found: Difference | Poses) -> str:
    seen = "whole" if not found.views else f"{found.views} view" + "s" * (found.views > 1)
    return f"{found.set.replace('+', ', ')}, {seen}"


def _line(texts: Sequence[str]) -> str:
    return f"| {' | '.join(texts)} |"
