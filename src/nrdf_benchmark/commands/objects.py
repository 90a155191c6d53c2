"""`nrdf eval objects`: parts of labelled meshes, each shown once and found on every other."""

from __future__ import annotations

import os
from typing import Annotated, Literal

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
from nrdf.io.bounds import Bounds, Count, NonNegativeCount
from nrdf.tasks import chosen_workers


@lock_output("out")
def objects(
    data: Folder,
    out: Folder | None = None,
    category: tuple[str, ...] = (),
    group: tuple[str, ...] = ("chair+stool",),
    method: tuple[str, ...] = ("nrdf", "registration", "box-mask", "box-normals"),
    model: str = "chair",
    views: tuple[Annotated[int, Bounds(0, 20)], ...] = (0, 3, 1),
    normals: Literal["estimated", "given"] = "estimated",
    points: Annotated[int, Bounds(256, 100_000)] = 8192,
    pairs: Count | None = None,
    jobs: NonNegativeCount = 30,
    device: str = "cpu",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    overwrite: bool = False,
) -> None:
    """Parts of real objects: labelled on one mesh, found on every other.

    Each part of a reference is a region, and is found on a target: intersection over union with the
    target's own label, for all ordered pairs of a category or group. Also how often a part that the
    target has is told absent, and one that it lacks is; and how many pairs come from the target's
    file to robot programs. Interrupted, the same command goes on. docs/evidence/objects.md has the
    data's form and every definition.

    Example: nrdf eval objects --data objects/ --out results/

    Args:
        data: Folder with labels.json, index.csv and <category>/<name>.npz.
        out: Folder for the tables, a row a pair and part (CSV), everything (JSON), and pictures of
            the worst pairs.
        category: Only these categories.
        group: Categories that share parts, joined by "+": objects of one are found on the others'.
        method: Methods to run: nrdf, nrdf-refined, general, registration, registration-model,
            box-mask, box-normals, box, copy, copy-normals.
        model: Zoo name, weight file or run, for all objects.
        views: Cameras of each simulated scan of a target; 0 is the whole cloud, in its own frame.
        normals: Of whole clouds: estimated, as of a scan, or the meshes' own.
        points: Of each whole cloud.
        pairs: Only so many pairs of each category or group, drawn at random.
        jobs: Pairs, drawn at random, that go from a mesh file to robot programs; 0 for none.
        device: cpu, cuda, cuda:N or auto.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
        overwrite: Start anew, whatever is in the folder.
    """
    from nrdf.errors import DataError
    from nrdf.field.weights import read_metadata
    from nrdf.field.zoo import find_weights
    from nrdf_benchmark.methods.registry import METHODS, find_methods
    from nrdf_benchmark.objects.dataset import read_objects
    from nrdf_benchmark.objects.evaluate import JOBS, evaluate_jobs, evaluate_objects, pairs_of
    from nrdf_benchmark.objects.pairs import draw_pairs, group_categories
    from nrdf_benchmark.objects.report import Report
    from nrdf_benchmark.objects.retrieval import Settings, check_choice, shared_retrieval
    from nrdf_benchmark.objects.table import cells, headings, rows_of, tables
    from nrdf_benchmark.result_cache import LineCache

    path = find_weights(model)
    check_choice(method, views)
    trained = str(read_metadata(path).get("category", ""))
    specs = find_methods(method, trained, [str(path)], device=device)
    with errors.status("reading the objects"):
        found = read_objects(data, category)
    groups = group_categories((item.entry.category for item in found), group)
    sets = {name: pairs_of(found, members) for name, members in groups.items()}
    if pairs is not None:
        sets = {name: draw_pairs(of, pairs) for name, of in sets.items()}
    all_pairs = [pair for of in sets.values() for pair in of]
    if not all_pairs:
        raise DataError(f"{data}: no two objects of a category; nothing can be compared")
    settings = Settings(data.resolve(), path.resolve(), points, normals, device)
    cache = None if out is None else LineCache(out, overwrite)
    count = chosen_workers(workers, cluster)
    chosen = draw_pairs(all_pairs, jobs)
    with progress_bars([*method, *[JOBS] * bool(chosen)]) as progress:
        results = evaluate_objects(settings, found, all_pairs, specs, views, count, cache, progress)
        done = evaluate_jobs(settings, found, chosen, count, cache, progress)
    for title, parts, rows in tables(rows_of(results, sets)):
        shown = table(title, "", *headings(parts))
        shown.padding = (0, 1, 0, 0)  # so that it fits into 80 columns
        shown.columns[0].no_wrap = True
        for row in rows:
            shown.add_row(row.method, *cells(row, parts, brief=True))
        show(shown)
    report = Report(results, sets, done)
    for line in report.lines():
        console.print(line)
    if out is None:
        return
    import hashlib
    from dataclasses import replace

    from nrdf.training.provenance import git_commit
    from nrdf_benchmark.objects.picture import draw_worst

    origin = {
        "command": command_line(),
        "versions": versions(),
        "commit": git_commit(),
        "cores": os.cpu_count(),
        "workers": count,
        "model": {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()},
        "normals": normals,
        "points": points,
        "objects": {item.key: item.checksum for item in found},
    }
    written = replace(report, origin=origin).write(out)
    drawn = next((spec for spec in specs if METHODS[spec.name].is_learned), specs[0])
    mine = [f for f in results if (f.method, f.views) == (drawn.name, views[0])]
    with errors.status("drawing the worst pairs"):
        draw_worst(shared_retrieval(settings), drawn, mine, out / "worst")
    console.print("wrote " + ", ".join(str(place) for place in (*written, out / "worst")))
