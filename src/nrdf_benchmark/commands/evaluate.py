"""`nrdf eval` and `nrdf bench`: how good, and how fast."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from nrdf.commands.console import (
    command_line,
    console,
    errors,
    progress_bar,
    progress_bars,
    show,
    table,
    versions,
)
from nrdf.commands.one_run import one_run_at
from nrdf.io.bounds import Count, CountFromZero

if TYPE_CHECKING:
    from nrdf_benchmark.bsrc import Benchmark
    from nrdf_benchmark.evaluate import MethodResult
    from nrdf_benchmark.latency import Failure, RetrievalSpeed, TrainingSpeed
    from nrdf_benchmark.transfer_speed import TransferSpeed


def evaluations() -> dict[str, Callable[..., Any]]:
    """Score: BSRC (bsrc), labelled meshes (objects), exact truth (families, carry, scans), shapes
    (shape), plans (toolpaths), what targets are taken for (kind); fit what tells absent regions
    (presence).

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/
    """
    from nrdf_benchmark.commands.evaluate_kind import kind
    from nrdf_benchmark.commands.evaluate_objects import objects
    from nrdf_benchmark.commands.evaluate_presence import presence
    from nrdf_benchmark.commands.evaluate_scans import scans
    from nrdf_benchmark.commands.evaluate_shape import shape
    from nrdf_benchmark.commands.evaluate_toolpaths import toolpaths
    from nrdf_benchmark.commands.evaluate_warp import carry

    return {
        "bsrc": bsrc,
        "objects": objects,
        "families": families,
        "carry": carry,
        "scans": scans,
        "kind": kind,
        "presence": presence,
        "toolpaths": toolpaths,
        "shape": shape,
    }


@one_run_at("out")
def bsrc(
    data: Path,
    category: Literal["chair", "car", "plane"],
    out: Path | None = None,
    method: tuple[str, ...] = ("nrdf", "nrdf-points", "copy", "box"),
    model: tuple[str, ...] = (),
    runs: Path = Path("runs"),
    labels: Literal["published", "corrected"] = "published",
    metric: str = "cd-l1",
    device: str = "cpu",
    workers: Count | None = None,
    overwrite: bool = False,
) -> None:
    """The paper's Table II: regions found on the benchmark's scans.

    On the Benchmark for Surface Region Correspondence (BSRC), every ordered pair of the objects
    that are there. CD-L1 in the paper's convention: for every point the Manhattan distance to its
    nearest neighbour in the other set, averaged, summed over both directions. Lower is better.
    With --out also every other metric (docs/benchmark.md), as Markdown, CSV and JSON, and a
    picture; interrupted, the same command goes on where it was.

    Methods: copy, box, copy-normals, box-normals, box-mask, registration (nothing learned); ndf,
    ndf-energy, imdc, nrdf-paper (trained rivals); nrdf, nrdf-refined, nrdf-points (the default
    field).

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/

    Args:
        data: BSRC's folder, with Chair, Car and plane in it.
        category: chair, car or plane.
        out: Folder for tables, figures of every pair, and a picture of the best learned method.
        method: Methods to run, rows of the table.
        model: METHOD=PATH of a weight file or run for a learned method; a zoo name or path alone
            is for those of the default field, which otherwise have the category's model in the zoo.
        runs: Where the rivals were trained: RUNS/CATEGORY-PRESET, presets ndf, imdc, paper.
        labels: As published, or corrected (plane5's wing regions are swapped as published).
        metric: Metric of the table: cd-l1, chamfer-l1, squared-cd, f-score-0.01, f-score-0.02,
            precision, recall, iou or side-accuracy.
        device: cpu, cuda, cuda:N or auto, of learned methods.
        workers: Processes; all cores unless given.
        overwrite: Start anew, whatever is in the folder.
    """
    from nrdf.errors import ConfigError, unknown_name
    from nrdf_benchmark.bsrc import read_bsrc
    from nrdf_benchmark.evaluate import evaluate
    from nrdf_benchmark.methods import METHODS, build_method, find_methods
    from nrdf_benchmark.metrics import METRICS
    from nrdf_benchmark.store import PairStore
    from nrdf_benchmark.table import write_results

    if metric not in METRICS:
        raise ConfigError(unknown_name("metric", metric, list(METRICS)))
    specs = find_methods(method, category, model, runs, device)
    with errors.status("reading the benchmark"):
        benchmark = read_bsrc(data, category, labels)
    workers = workers or os.cpu_count() or 1
    store = None if out is None else PairStore(out, overwrite)
    with progress_bars(method) as progress:
        results = evaluate(benchmark, specs, workers, store, progress)
    _show_table(results, benchmark, metric)
    if out is None:
        return
    from nrdf.training.provenance import git_commit
    from nrdf_benchmark.figure import draw_comparison

    origin = {
        "versions": versions(),
        "commit": git_commit(),
        "cores": os.cpu_count(),
        "workers": workers,
        "command": command_line(),
    }
    written = write_results(results, benchmark, metric, out, origin)
    learned = [result for result in results if METHODS[result.spec.name].is_learned]
    drawn = min(learned or results[:1], key=lambda result: result.mean()).spec
    corrected = "" if labels == "published" else f"-{labels}"
    written.append(out / f"figure-{category}{corrected}.png")
    with errors.status("drawing"):
        draw_comparison(benchmark, drawn.name, build_method(drawn), written[-1])
    console.print("wrote " + ", ".join(str(path) for path in written))


def _show_table(results: list[MethodResult], benchmark: Benchmark, metric: str) -> None:
    from nrdf_benchmark.table import caption, cells, confidence_lines, headings, rows

    title, formula = caption(benchmark, metric)
    shown = table(title, "", *headings(benchmark))
    shown.padding = (0, 1, 0, 0)  # eight regions fit into 80 columns
    shown.columns[0].no_wrap = True
    for row in rows(results, benchmark, metric):
        shown.add_row(row.name, *cells(row, metric), style=None if row.seconds else "dim")
    show(shown)
    if metric == "cd-l1":
        console.print("published: all 90 pairs of a category, fields trained on other data")
    console.print(formula)
    for line in confidence_lines(results):
        console.print(line)


def families(
    category: Literal["chair", "car", "plane", "table"],
    model: str | None = None,
    pairs: Count = 50,
    device: str = "cpu",
) -> None:
    """The field against the exact truth of the parametric families.

    Mean distance of C's prediction from the exact corresponding point, on pairs of parametric
    shapes that no training set holds, beside that of a bounding-box copy.

    Example: nrdf eval families --category chair

    Args:
        category: chair, car, plane or table.
        model: Zoo name, weight file or run; the category's model in the zoo unless given.
        pairs: Pairs of members.
        device: cpu, cuda, cuda:N or auto.
    """
    import numpy as np

    import nrdf
    from nrdf_benchmark.family import evaluate_family

    loaded = nrdf.load_model(model or category, device)
    with progress_bar(f"pairs of {category}s") as progress:
        found = evaluate_family(loaded, category, pairs, progress)
    shown = table("", f"{pairs} pairs, {category}", "mean error", "median pair", "worst pair")
    for name, error in (("C", found.field), ("bounding-box copy", found.box)):
        shown.add_row(name, *(f"{f(error):.4f}" for f in (np.mean, np.median, np.max)))
    show(shown)
    console.print(
        f"C is {found.ratio:.1f} times closer; lengths are shares of the longest side. "
        f"{found.shared.mean():.0%} of a reference's surface exists on its target."
    )


@one_run_at("out")
def bench(
    preset: tuple[str, ...] = ("default", "paper"),
    device: str = "cpu",
    repeats: Count = 7,
    steps: CountFromZero = 3,
    robot: Path | None = None,
    out: Path | None = None,
) -> None:
    """Measure speed and memory of retrieval, transfer and training; or a demonstration on an arm.

    8 regions on a target of 8192 points without normals, the reference embedded before; transfer
    with the chairs' model. Every other measurement runs in a process of its own.

    Example: nrdf bench --out bench.json

    Args:
        preset: Presets to measure.
        device: cpu, cuda, cuda:N or auto.
        repeats: Warm retrievals, of which the median is taken.
        steps: Training steps a stage, of which the median is taken; 0 leaves training out.
        robot: Folder of `nrdf demo`, whose chairs are driven on the bundled arm, instead of all the
            rest: reach, accuracy, collisions, force, coverage, speed.
        out: JSON file to write.
    """
    from nrdf.io.output import write_json
    from nrdf_benchmark.latency import measure, to_json
    from nrdf_benchmark.transfer_speed import measure_transfer

    if robot is not None:
        from nrdf_benchmark.commands.bench_robot import bench_robot

        bench_robot(robot, out)
        return

    with errors.status("measuring") as status:
        retrieval, training, failures = measure(preset, device, repeats, steps, status.update)
        status.update("transfer")
        transfer = measure_transfer(device, repeats)
    show_speeds(retrieval, training, failures)
    show_transfer_speed(transfer)
    if out is not None:
        content = {**to_json(retrieval, training, failures), "transfer": vars(transfer)}
        write_json(out, {"versions": versions(), **content})
        console.print(f"wrote {out}")


def show_transfer_speed(transfer: TransferSpeed) -> None:
    """A table of a transfer's time by phase."""
    from nrdf_benchmark.transfer_speed import TRANSFER_BAR_S

    title = f"\ntransfer, {transfer.regions} regions, {transfer.points} points"
    shown = table(title, "", "s", "must keep to")
    shown.add_row("further targets, all files", f"{transfer.wall_s:.2f}", f"{TRANSFER_BAR_S:g}")
    for phase, seconds in transfer.phases.items():
        shown.add_row(f"  {phase}", f"{seconds:.2f}", "")
    shown.add_row("CPU time, all threads", f"{transfer.cpu_s:.2f}", "")
    show(shown)


def show_speeds(
    retrieval: list[RetrievalSpeed], training: list[TrainingSpeed], failures: list[Failure]
) -> None:
    """Two tables, and what could not be measured."""
    from nrdf_benchmark.latency import BARS

    names = (f"{s.preset} ({s.model}, {s.device})" for s in retrieval)
    shown = table("retrieval", "", *names, "default must keep to")
    bars = {
        "further targets, 8 regions, s": BARS["warm_s"],
        "nrdf retrieve, cold shell, s": BARS["command_s"],
        "peak memory, GB": BARS["peak_memory_bytes"] / 1e9,
    }
    rows = [("load weights, s", [s.load_s for s in retrieval])]
    rows.append(("reference, s", [s.reference_s for s in retrieval]))
    rows.append(("first target, 8 regions, s", [s.cold_s for s in retrieval]))
    rows.append(("further targets, 8 regions, s", [s.warm_s for s in retrieval]))
    for phase in retrieval[0].warm_phases if retrieval else ():
        rows.append((f"  {phase}", [s.warm_phases[phase] for s in retrieval]))
    rows.append(("nrdf retrieve, cold shell, s", [s.command_s or 0.0 for s in retrieval]))
    rows.append(("peak memory, GB", [s.peak_memory_bytes / 1e9 for s in retrieval]))
    for name, values in rows:
        bar = f"{bars[name]:g}" if name in bars else ""
        shown.add_row(name, *(f"{value:.3f}" for value in values), bar)
    show(shown)
    shown = table(
        "\ntraining", "preset", "stage", "batch", "precision", "s/step", "points/s", "memory, GB"
    )
    for t in training:
        memory = (t.device_memory_bytes or t.peak_memory_bytes) / 1e9
        shown.add_row(
            f"{t.preset} ({t.device})", t.stage, str(t.batch_size), t.precision,
            f"{t.step_s:.3f}", f"{t.points_per_s:,.0f}", f"{memory:.2f}",
        )  # fmt: skip
    if training:
        show(shown)
    for failure in failures:
        console.print(f"{failure.preset}, {failure.what}: {failure.reason}", style="yellow")
