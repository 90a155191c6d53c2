"""Tables of tool paths on real meshes, with the bars beside them; CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.io.atomic import write_atomically
from nrdf_benchmark.mesh_paths.evaluate import MeshPathResult
from nrdf_benchmark.mesh_paths.measure import MeshPathMetrics

HEADINGS = ("bar", "met by", "median", "worst")
COMPARISON = "comparison.md"


@dataclass(frozen=True)
class MeshRow:
    """A figure of all regions: what it is, the bar, and what HEADINGS say of it, as people read
    it."""

    name: str
    cells: tuple[str, str, str, str]


@dataclass(frozen=True)
class _Figure:
    """A figure of a region. value: None where it has none; least: whether the value must be at
    least the limit, instead of at most. roles, planners: of regions with those names, and of those
    that were planned so, where it is not of all."""

    name: str
    bar: str
    limit: float
    value: Callable[[MeshPathMetrics], float | None]
    least: bool = False
    roles: tuple[str, ...] = ()
    planners: tuple[str, ...] = ()


PLATES = ("seat", "back", "top", "shelf", "bonnet", "roof", "door", "all")
RODS = ("leg", "rail", "arm")
FIGURES = (
    _Figure("contacts from given mesh, 99 %, mm", "<= 0.1", 0.1, lambda m: 1e3 * m.distance_99_m),
    _Figure("contacts, worst, mm", "<= 0.5", 0.5, lambda m: 1e3 * m.distance_worst_m),
    _Figure("left out of the region, %", "", np.inf, lambda m: 100.0 * m.left_out),
    _Figure("no clearance for a tool, %", "", np.inf, lambda m: 100.0 * m.no_clearance),
    _Figure("unreached in it, %", "<= 1", 1.0, lambda m: 100.0 * m.unreached),
    _Figure("border for the true one's", "<= 1.1", 1.1, lambda m: m.border_ratio),
    _Figure("IoU with the true region, %", "", 0.0, lambda m: m.iou and 100.0 * m.iou, True),
    _Figure("largest step, spacings", "<= 2", 2.0 + 1e-6, lambda m: m.step_worst),
    _Figure(
        "turn of the axis, degrees a mm", "<= 3", 3.0 + 1e-6,
        lambda m: float(np.degrees(m.turn_worst_rad_m)) / 1e3,
    ),
    _Figure("coverage, %", ">= 99", 99.0, lambda m: 100.0 * m.coverage, True),
    _Figure(
        "neighbours 0.85 to 1.15 stepovers, %", ">= 98", 98.0,
        lambda m: None if m.spacing_even is None else 100.0 * m.spacing_even, True,
    ),
    _Figure("widest spacing, stepovers", "<= 1.3", 1.3, lambda m: m.spacing_worst),
    _Figure("strokes of a region", "", np.inf, lambda m: float(m.strokes)),
    _Figure("strokes of a plate or back", "1", 1.0, lambda m: m.strokes / m.parts, roles=PLATES),
    _Figure("strokes of a leg or rail", "<= 8", 8.0, lambda m: m.strokes / m.parts, roles=RODS),
    _Figure("strokes of a spiral", "1", 1.0, lambda m: m.strokes / m.parts, planners=("spiral",)),
    _Figure("median stroke, region's lengths", ">= 0.6", 0.6, lambda m: m.stroke_ratio, True),
    _Figure("strokes under the tool's radius", "", np.inf, lambda m: float(m.short_strokes)),
    _Figure("of them needless", "0", 0.0, lambda m: float(m.needless_strokes)),
    _Figure("air, m a m on the surface", "<= 0.5", 0.5, lambda m: m.air_m / max(m.surface_m, 1e-9)),
)  # fmt: skip
"""What is shown, in the order of the table."""


def mesh_rows(results: Sequence[MeshPathResult]) -> list[MeshRow]:
    """A row for each figure, over all regions that have a path."""
    rows = []
    for figure in FIGURES:
        values = _values(figure, results)
        if not len(values):
            continue
        met = values >= figure.limit if figure.least else values <= figure.limit
        worst = values.min() if figure.least else values.max()
        share = f"{met.mean():.0%}" if figure.bar else ""
        cells = (figure.bar, share, _short(np.median(values)), _short(worst))
        rows.append(MeshRow(figure.name, cells))
    return rows


def comparison(
    by_planner: Mapping[str, Sequence[MeshPathResult]],
) -> list[tuple[str, list[tuple[str, ...]]]]:
    """Planners side by side on the regions that all of them planned: for flat and for curved ones
    the rows, each of a figure's name, its bar and, for each planner, "met by; median; worst"."""
    planned = [
        {(r.target, r.region) for r in results if r.metrics is not None}
        for results in by_planner.values()
    ]
    common = set.intersection(*planned)
    # Curvature is the given mesh's, so that any planner's results tell it.
    first = next(iter(by_planner.values()))
    kinds = {(r.target, r.region): r.metrics.curved for r in first if r.metrics is not None}
    tables = []
    for what, curved in (("flat regions", False), ("curved regions", True)):
        keys = {key for key in common if kinds[key] == curved}
        chosen = {
            name: [r for r in results if (r.target, r.region) in keys]
            for name, results in by_planner.items()
        }
        columns = [{row.name: row.cells for row in mesh_rows(own)} for own in chosen.values()]
        rows = []
        for figure in FIGURES:
            if any(figure.name in column for column in columns):
                cells = [
                    "; ".join(filter(None, c.get(figure.name, ("",) * 4)[1:])) for c in columns
                ]
                rows.append((figure.name, figure.bar, *cells))
        tables.append((f"{what}, {len(keys)}", rows))
    return tables


def _values(figure: _Figure, results: Sequence[MeshPathResult]) -> np.ndarray:
    """What a figure is on those regions (n,) that have it."""
    asked = [
        result.metrics
        for result in results
        if result.metrics is not None
        and (not figure.roles or result.region in figure.roles)
        and (not figure.planners or result.planner in figure.planners)
    ]
    return np.array([v for m in asked if (v := figure.value(m)) is not None])


def totals(results: Sequence[MeshPathResult]) -> str:
    """One sentence on all regions together."""
    planned = [result.metrics for result in results if result.metrics is not None]
    surface = sum(m.surface_m for m in planned)
    air = sum(m.air_m for m in planned)
    strokes = sum(m.strokes for m in planned)
    seconds = sum(result.seconds for result in results)
    needless = sum(m.needless_strokes for m in planned)
    ratios = [m.stroke_ratio for m in planned for _ in range(m.strokes)]
    return (
        f"{len(planned)} of {len(results)} regions planned: {strokes} strokes, {surface:.1f} m on "
        f"the surface, {air / max(surface, 1e-9):.2f} m of air for each (bar 0.5), "
        f"{needless} needless strokes (bar 0), median stroke {np.median(ratios or [0]):.2f} of its "
        f"region's length (bar 0.6), "
        f"{8.0 * seconds / max(len(results), 1):.1f} s of CPU time for 8 regions"
    )


def markdown(results: Sequence[MeshPathResult], title: str) -> str:
    """The tables, and the regions without a path."""
    lines = [f"# {title}"]
    for what, chosen in selections(results):
        lines += ["", f"## {what}, {len(chosen)}", "", f"| | {' | '.join(HEADINGS)} |"]
        lines.append("|---" * (len(HEADINGS) + 1) + "|")
        lines += [f"| {row.name} | {' | '.join(row.cells)} |" for row in mesh_rows(chosen)]
    lines += ["", totals(results), ""]
    lines += [f"- {r.target}, {r.region}: no path: {r.error}" for r in results if r.error]
    return "\n".join(lines) + "\n"


def selections(
    results: Sequence[MeshPathResult],
) -> list[tuple[str, list[MeshPathResult]]]:
    """All regions; those that the tool's footprint fits into; flat and curved ones."""
    planned = [(result, result.metrics) for result in results if result.metrics is not None]
    return [
        ("all regions", list(results)),
        ("those that the footprint fits into", [r for r, m in planned if m.fits]),
        ("flat ones", [r for r, m in planned if not m.curved]),
        ("curved ones", [r for r, m in planned if m.curved]),
    ]


def to_csv(results: Sequence[MeshPathResult]) -> str:
    """A line for each region, in SI units."""
    text = io.StringIO()
    names = MeshPathMetrics.names()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["planner", "target", "region", "seconds", *names, "error"])
    for result in results:
        values = [None if result.metrics is None else getattr(result.metrics, n) for n in names]
        row = [result.planner, result.target, result.region, f"{result.seconds:.3f}"]
        writer.writerow([*row, *values, result.error])
    return text.getvalue()


def write_results(
    folder: Path,
    name: str,
    results: Sequence[MeshPathResult],
    title: str,
    origin: Mapping[str, Any],
) -> list[Path]:
    """The tables as Markdown, the figures as CSV and JSON: the paths of the files `name`.*."""
    content = {"origin": dict(origin), "results": [asdict(result) for result in results]}
    texts = {
        ".md": markdown(results, title),
        ".csv": to_csv(results),
        ".json": json.dumps(content, indent=1) + "\n",
    }
    written = []
    for suffix, text in texts.items():
        path = folder / f"{name}{suffix}"
        write_atomically(path, [text.encode()])
        written.append(path)
    return written


def write_comparison(folder: Path, by_planner: Mapping[str, Sequence[MeshPathResult]]) -> Path:
    """`comparison` as Markdown: the file's path."""
    lines = ["# Planners side by side: met by; median; worst"]
    for what, rows in comparison(by_planner):
        lines += ["", f"## {what}", "", f"| | bar | {' | '.join(by_planner)} |"]
        lines.append("|---" * (len(by_planner) + 2) + "|")
        lines += [f"| {' | '.join(row)} |" for row in rows]
    path = folder / COMPARISON
    write_atomically(path, ["\n".join([*lines, ""]).encode()])
    return path


def _short(value: float) -> str:
    return f"{value:.4g}" if value < 1000 else f"{value:.0f}"
