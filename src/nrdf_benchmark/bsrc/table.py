"""The paper's Table II with our rows: on a terminal, as Markdown, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.io.atomic import write_atomically
from nrdf.io.file_names import spreadsheet_text
from nrdf_benchmark import metrics
from nrdf_benchmark.bsrc.dataset import CORRECTIONS, Benchmark
from nrdf_benchmark.bsrc.evaluate import MethodResult
from nrdf_benchmark.methods.baselines import SEED
from nrdf_benchmark.methods.registry import METHODS
from nrdf_benchmark.metrics import METRICS
from nrdf_benchmark.result_cache import code_checksum

PUBLISHED = {
    "chair": {"NDF": 0.230, "IMDC": 0.063, "NRDF": 0.039},
    "car": {"NDF": 0.194, "IMDC": 0.024, "NRDF": 0.019},
    "plane": {"NDF": 0.142, "IMDC": 0.047, "NRDF": 0.035},
}
"""Mean CD-L1 of the paper's Table II, over all 90 pairs of a category."""
PUBLISHED_BY_ROI = {
    ("chair", "NDF"): (0.138, 0.141, 0.131, 0.124, 0.361, 0.326, 0.305, 0.312),
    ("chair", "IMDC"): (0.024, 0.068, 0.046, 0.042, 0.067, 0.074, 0.094, 0.090),
    ("chair", "NRDF"): (0.025, 0.029, 0.042, 0.029, 0.051, 0.047, 0.048, 0.044),
    ("car", "NDF"): (0.088, 0.350, 0.084, 0.210, 0.221, 0.233, 0.272, 0.094),
    ("car", "IMDC"): (0.019, 0.025, 0.031, 0.024, 0.021, 0.022, 0.026, 0.022),
    ("car", "NRDF"): (0.018, 0.014, 0.031, 0.022, 0.021, 0.014, 0.014, 0.017),
    ("plane", "NDF"): (0.100, 0.098, 0.065, 0.095, 0.070, 0.220, 0.238, 0.231),
    ("plane", "IMDC"): (0.028, 0.040, 0.063, 0.098, 0.033, 0.037, 0.034, 0.039),
    ("plane", "NRDF"): (0.023, 0.030, 0.039, 0.054, 0.034, 0.035, 0.031, 0.031),
}
"""The same by region, in the order of `ROIS`."""


@dataclass(frozen=True)
class Row:
    """A line of the table: one value a region and the mean, None where there is none."""

    name: str
    description: str
    by_roi: tuple[float | None, ...]
    mean: float | None
    seconds: float | None = None


def rows(results: Sequence[MethodResult], benchmark: Benchmark, metric: str) -> list[Row]:
    """A row a method, and for CD-L1 what the paper published below."""
    found = [
        Row(
            result.spec.name,
            METHODS[result.spec.name].description,
            tuple(_known(value) for value in result.by_roi(metric)),
            _known(result.mean(metric)),
            float(np.median(result.seconds)),
        )
        for result in results
    ]
    if metric == "cd-l1":
        for name, mean in PUBLISHED[benchmark.category].items():
            by_roi = PUBLISHED_BY_ROI[benchmark.category, name]
            found.append(
                Row(f"published {name}", "all 90 pairs, other training data", by_roi, mean)
            )
    return found


def headings(benchmark: Benchmark) -> list[str]:
    """The columns of the table after the first."""
    return [*benchmark.rois, "mean", "s/pair"]


def cells(row: Row, metric: str) -> list[str]:
    """A row's texts for `headings`, empty where there is no value."""
    digits = METRICS[metric].digits
    by_roi = ["" if value is None else f"{value:.{digits - 1}f}" for value in row.by_roi]
    # The paper gives three digits.
    mean = "" if row.mean is None else f"{row.mean:.{digits if row.seconds is not None else 3}f}"
    return [*by_roi, mean, "" if row.seconds is None else f"{row.seconds:.2f}"]


def caption(benchmark: Benchmark, metric: str) -> tuple[str, str]:
    """What the table is of, and what its metric is."""
    chosen = METRICS[metric]
    better = "higher" if chosen.higher_is_better else "lower"
    return (
        f"{chosen.title}: {benchmark.describe()}",
        f"{chosen.formula[0].upper()}{chosen.formula[1:]}; {better} is better.",
    )


def markdown(results: Sequence[MethodResult], benchmark: Benchmark, metric: str) -> str:
    """The table of one metric by region, and the means of all metrics."""
    title, formula = caption(benchmark, metric)
    lines = [f"# {title}", "", formula, "", _line(["", *headings(benchmark)])]
    lines.append("|---" * (len(benchmark.rois) + 3) + "|")
    for row in rows(results, benchmark, metric):
        name = row.name if row.seconds is None else f"`{row.name}`"
        *by_roi, mean, seconds = cells(row, metric)
        lines.append(_line([f"{name}: {row.description}", *by_roi, f"**{mean}**", seconds]))
    lines += ["", "Means over all pairs and regions, of every metric:", ""]
    lines.append(_line(["", *(chosen.title for chosen in METRICS.values()), "regions missed"]))
    lines.append("|---" * (len(METRICS) + 2) + "|")
    for result in results:
        means = [_text(result.mean(name), chosen.digits) for name, chosen in METRICS.items()]
        lines.append(_line([f"`{result.spec.name}`", *means, str(result.missed)]))
    lines += ["", *(f"- {text}" for text in confidence_lines(results))]
    lines += [
        "",
        "Seconds a pair: median wall time of finding all regions on a target, the reference "
        "encoded before, each process with one thread. A region found nowhere counts as "
        f"{metrics.MISSED:g} in distances and 0 in shares.",
    ]
    return "\n".join(lines) + "\n"


def confidence_lines(results: Sequence[MethodResult]) -> list[str]:
    """For each method with confidence: CD-L1 where it is sure, and where it is not."""
    lines = []
    for result in results:
        quarters = result.by_confidence()
        if quarters is not None:
            sure, unsure = quarters
            lines.append(
                f"confidence of {result.spec.name}: mean CD-L1 {sure:.4f} in the quarter of "
                f"regions of highest confidence, {unsure:.4f} in the quarter of lowest"
            )
    return lines


def to_csv(results: Sequence[MethodResult], benchmark: Benchmark) -> str:
    """A row a method, pair and region with every metric; empty where one has no value."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = ["category", "labels", "method", "reference", "target", "roi", "points", "confidence"]
    writer.writerow([*columns, *METRICS, "seconds_a_pair"])
    for result in results:
        for pair in result.pairs:
            for roi in benchmark.rois:
                which = [benchmark.category, benchmark.labels, result.spec.name]
                sure = f"{pair.confidence[roi]:.6g}" if pair.confidence else ""
                which += map(spreadsheet_text, (pair.reference, pair.target, roi))
                which += [str(pair.points[roi]), sure]
                values = (pair.metrics[roi][name] for name in METRICS)
                texts = ["" if value is None else f"{value:.9g}" for value in values]
                writer.writerow([*which, *texts, f"{pair.seconds:.4f}"])
    return text.getvalue()


def to_json(
    results: Sequence[MethodResult], benchmark: Benchmark, provenance: Mapping[str, Any]
) -> dict[str, Any]:
    """Everything: every pair's metrics, what they mean and where they come from."""
    corrected = benchmark.labels == "corrected"
    applied = [c for c in CORRECTIONS if corrected and c.category == benchmark.category]
    return {
        "category": benchmark.category,
        "labels": benchmark.labels,
        "objects": {item.name: item.checksum for item in benchmark.objects},
        "missing_objects": benchmark.missing,
        "corrections": [vars(correction) for correction in applied],
        "rois": benchmark.rois,
        "metrics": {name: chosen.formula for name, chosen in METRICS.items()},
        "missed_chamfer_distance": metrics.MISSED,
        "published_mean_cd_l1": PUBLISHED[benchmark.category],
        "seed": SEED,
        "metrics_version": metrics.VERSION,
        "code_sha256": code_checksum(),
        **provenance,
        "methods": {result.spec.name: _method_json(result) for result in results},
    }


def write_results(
    results: Sequence[MethodResult],
    benchmark: Benchmark,
    metric: str,
    folder: Path,
    provenance: Mapping[str, Any],
) -> list[Path]:
    """Write `table2-<category>-<labels>` as .md, .csv and .json into `folder`; their paths.

    Each file is whole or as it was. Raises OutputError.
    """
    stem = folder / f"table2-{benchmark.category}-{benchmark.labels}"
    content = to_json(results, benchmark, provenance)
    texts = {
        ".md": markdown(results, benchmark, metric),
        ".csv": to_csv(results, benchmark),
        ".json": json.dumps(content, indent=1, ensure_ascii=False) + "\n",
    }
    for ending, text in texts.items():
        write_atomically(stem.with_suffix(ending), [text.encode("utf-8")])
    return [stem.with_suffix(ending) for ending in texts]


def _method_json(result: MethodResult) -> dict[str, Any]:
    spec = result.spec
    return {
        "description": METHODS[spec.name].description,
        "weights": None if spec.weights is None else spec.weights.name,
        "weights_sha256": spec.sha256,
        "device": spec.device,
        "mean": {name: _known(result.mean(name)) for name in METRICS},
        "median_seconds_a_pair": float(np.median(result.seconds)),
        "regions_missed": result.missed,
        "pairs": [vars(pair) for pair in result.pairs],
    }


def _known(value: float) -> float | None:
    return None if np.isnan(value) else float(value)


def _text(value: float, digits: int) -> str:
    return "" if np.isnan(value) else f"{value:.{digits}f}"


def _line(texts: Sequence[str]) -> str:
    return f"| {' | '.join(texts)} |"
