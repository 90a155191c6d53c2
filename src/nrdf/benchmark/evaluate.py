"""Table II: every method on every ordered pair of BSRC, the paper's convention."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.benchmark.bsrc import ROIS, BenchmarkObject, ordered_pairs
from nrdf.benchmark.methods import DESCRIPTIONS, Method
from nrdf.benchmark.metrics import chamfer_l1
from nrdf.errors import OutputError
from nrdf.ply import write_atomically

MISSED = 1.0
"""CD-L1 that a region found nowhere is counted with: about the object's own length."""

PUBLISHED = {
    "chair": {"NDF": 0.230, "IMDC": 0.063, "NRDF": 0.039},
    "car": {"NDF": 0.194, "IMDC": 0.024, "NRDF": 0.019},
    "plane": {"NDF": 0.142, "IMDC": 0.047, "NRDF": 0.035},
}
"""Mean CD-L1 of the paper's Table II, over all 90 pairs of a category."""


@dataclass(frozen=True)
class MethodResult:
    """One method's CD-L1 of every pair and region, and the seconds each pair took.

    pairs: (reference, target) names; distance: (pairs, regions); seconds: (pairs,).
    """

    method: str
    pairs: list[tuple[str, str]]
    rois: tuple[str, ...]
    distance: np.ndarray
    seconds: np.ndarray

    @property
    def mean(self) -> float:
        """Mean CD-L1 over all pairs and regions."""
        return float(self.distance.mean())


def evaluate(
    name: str,
    method: Method,
    objects: list[BenchmarkObject],
    category: str,
    progress: Callable[[int, int], None] | None = None,
) -> MethodResult:
    """Run one method on all ordered pairs. `progress` is told (done, all).

    A region that is found nowhere counts as `MISSED`.
    """
    pairs = ordered_pairs(objects)
    rois = ROIS[category]
    distance = np.full((len(pairs), len(rois)), MISSED)
    seconds = np.zeros(len(pairs))
    for number, (reference, target) in enumerate(pairs):
        start = time.perf_counter()
        found = method(reference, target)
        seconds[number] = time.perf_counter() - start
        for column, roi in enumerate(rois):
            if len(found[roi]):
                points = target.cloud.points[found[roi]]
                distance[number, column] = chamfer_l1(points, target.regions[roi])
        if progress is not None:
            progress(number + 1, len(pairs))
    names = [(reference.name, target.name) for reference, target in pairs]
    return MethodResult(name, names, rois, distance, seconds)


def table(results: Sequence[MethodResult], category: str) -> str:
    """Markdown: a row a method, a column a region, and the published means below."""
    rois = ROIS[category]
    lines = [
        f"| {category}: CD-L1 | {' | '.join(rois)} | **mean** | s a pair |",
        "|---" * (len(rois) + 3) + "|",
    ]
    for result in results:
        cells = " | ".join(f"{value:.3f}" for value in result.distance.mean(0))
        lines.append(
            f"| {result.method}: {DESCRIPTIONS[result.method]} | {cells} | **{result.mean:.4f}** "
            f"| {np.median(result.seconds):.2f} |"
        )
    for name, mean in PUBLISHED[category].items():
        lines.append(f"| published {name} (all 90 pairs) |{' |' * len(rois)} {mean:.3f} | |")
    return "\n".join(lines)


def write_results(
    results: Sequence[MethodResult], category: str, labels: str, folder: Path
) -> None:
    """Write `table2-<category>-<labels>.md` and `.json` (every pair's figures) into `folder`.

    Raises OutputError if the folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror or error}") from error
    stem = folder / f"table2-{category}-{labels}"
    markdown = table(results, category) + "\n"
    write_atomically(stem.with_suffix(".md"), [markdown.encode("utf-8")])
    content = {
        "category": category,
        "labels": labels,
        "convention": "Manhattan nearest-neighbour distance, mean, summed over both directions",
        "rois": ROIS[category],
        "published_mean": PUBLISHED[category],
        "methods": {
            result.method: {
                "mean": result.mean,
                "pairs": [
                    {
                        "reference": reference,
                        "target": target,
                        "cd_l1": [round(float(value), 6) for value in row],
                        "seconds": round(float(seconds), 4),
                    }
                    for (reference, target), row, seconds in zip(
                        result.pairs, result.distance, result.seconds, strict=True
                    )
                ],
            }
            for result in results
        },
    }
    write_atomically(stem.with_suffix(".json"), [json.dumps(content, indent=1).encode("utf-8")])
