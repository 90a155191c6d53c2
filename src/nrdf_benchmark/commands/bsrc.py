"""`nrdf eval bsrc`: regions found on the benchmark's scans (the paper's Table II)."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from nrdf.commands.console import (
    command_line,
    console,
    errors,
    progress_bars,
    show,
    table,
    versions,
)
from nrdf.commands.options import Cluster, Folder
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Count
from nrdf.tasks import chosen_workers

if TYPE_CHECKING:
    from nrdf_benchmark.bsrc.dataset import Benchmark
    from nrdf_benchmark.bsrc.evaluate import MethodResult


@lock_output("out")
def bsrc(
    data: Folder,
    category: Literal["chair", "car", "plane"],
    out: Folder | None = None,
    method: tuple[str, ...] = ("nrdf", "nrdf-points", "copy", "box"),
    model: tuple[str, ...] = (),
    runs: Folder = Path("runs"),
    labels: Literal["published", "corrected"] = "published",
    metric: str = "cd-l1",
    device: str = "cpu",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    overwrite: bool = False,
) -> None:
    """The paper's Table II: regions found on the benchmark's scans.

    On the Benchmark for Surface Region Correspondence (BSRC), every ordered pair of the objects
    that are there. CD-L1 in the paper's convention: for every point the Manhattan distance to its
    nearest neighbour in the other set, averaged, summed over both directions. Lower is better.
    With --out also every other metric (docs/evidence/bsrc.md), as Markdown, CSV and JSON, and a
    picture; interrupted, the same command goes on where it was.

    Methods: copy, box, copy-normals, box-normals, box-mask, registration (nothing learned); ndf,
    ndf-energy, imdc, nrdf-paper (trained rivals); nrdf, nrdf-refined, nrdf-points (the
    category's own field); general (the field for every category); registration-model.

    Example: nrdf eval bsrc --data bsrc/ --category chair --method nrdf copy box --out results/

    Args:
        data: BSRC's folder, with Chair, Car and plane in it.
        category: chair, car or plane.
        out: Folder for tables, figures of every pair, and a picture of the best learned method.
        method: Methods to run, rows of the table.
        model: METHOD=PATH of a weight file or run for a learned method; a zoo name or path alone
            is for the three nrdf ones, which otherwise have the category's model in the zoo.
        runs: Where the rivals were trained: RUNS/CATEGORY-PRESET, presets ndf, imdc, paper;
            what is not there comes with the benchmark, where it is small enough.
        labels: As published, or corrected (plane5's wing regions are swapped as published).
        metric: Metric of the table: cd-l1, chamfer-l1, squared-cd, f-score-0.01, f-score-0.02,
            precision, recall, iou or side-accuracy.
        device: cpu, cuda, cuda:N or auto, of learned methods.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
        overwrite: Start anew, whatever is in the folder.
    """
    from nrdf.errors import ConfigError, unknown_name
    from nrdf_benchmark.bsrc.dataset import read_bsrc
    from nrdf_benchmark.bsrc.evaluate import evaluate
    from nrdf_benchmark.bsrc.table import write_results
    from nrdf_benchmark.methods.registry import METHODS, build_method, find_methods
    from nrdf_benchmark.metrics import METRICS
    from nrdf_benchmark.result_cache import PairCache

    if metric not in METRICS:
        raise ConfigError(unknown_name("metric", metric, list(METRICS)))
    specs = find_methods(method, category, model, runs, device)
    with errors.status("reading the benchmark"):
        benchmark = read_bsrc(data, category, labels)
    count = chosen_workers(workers, cluster)
    cache = None if out is None else PairCache(out, overwrite)
    with progress_bars(method) as progress:
        results = evaluate(benchmark, specs, count, cache, progress)
    _show_table(results, benchmark, metric)
    if out is None:
        return
    from nrdf.training.provenance import git_commit
    from nrdf_benchmark.bsrc.picture import draw_comparison

    origin = {
        "versions": versions(),
        "commit": git_commit(),
        "cores": os.cpu_count(),
        "workers": count,
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
    from nrdf_benchmark.bsrc.table import caption, cells, confidence_lines, headings, rows

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
