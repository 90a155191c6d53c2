"""`nrdf eval objects`: parts of labelled meshes, each shown once and found on every other."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from nrdf.bounds import Count, CountFromZero
from nrdf.commands.console import (
    errors,
    progress_bars,
    show,
    table,
)


def objects(
    data: Path,
    out: Path | None = None,
    category: tuple[str, ...] = (),
    group: tuple[str, ...] = ("chair+stool",),
    method: tuple[str, ...] = ("nrdf", "registration", "box-mask", "box-normals"),
    model: str = "chair",
    views: tuple[CountFromZero, ...] = (0,),
    normals: Literal["estimated", "given"] = "estimated",
    points: Count = 8192,
    device: str = "cpu",
    workers: Count | None = None,
    overwrite: bool = False,
) -> None:
    """Parts of real objects: labelled on one mesh, found on every other.

    Each part of a reference is a region, and is found on a target: intersection over union with the
    target's own label, for all ordered pairs of a category or group. Also how often a part that the
    target has is told absent, and one that it lacks is. Interrupted, the same command goes on.
    docs/benchmark.md has the data's form and every definition.

    Example: nrdf eval objects --data objects/ --out results/

    Args:
        data: Folder with labels.json, index.csv and <category>/<name>.npz.
        out: Folder for the table, a row a pair and part (CSV), and everything (JSON).
        category: Only these categories.
        group: Categories that share parts, joined by "+": objects of one are found on the others'.
        method: Methods to run: nrdf, nrdf-refined, registration, box-mask, box-normals, box, copy,
            copy-normals.
        model: Zoo name, weight file or run, for all objects.
        views: Cameras of each simulated scan of a target; 0 is the whole cloud, in its own frame.
        normals: Of the clouds: estimated, as of a scan, or the meshes' own.
        points: Of each whole cloud.
        device: cpu, cuda, cuda:N or auto.
        workers: Processes; all cores unless given.
        overwrite: Start anew, whatever is in the folder.
    """
    from nrdf.benchmark.methods import find_methods
    from nrdf.benchmark.objects import read_objects
    from nrdf.benchmark.objects_match import Settings, check_usable, check_views
    from nrdf.benchmark.objects_pairs import group_categories
    from nrdf.benchmark.objects_run import evaluate_objects, pairs_of
    from nrdf.benchmark.objects_table import cells, headings, rows_of, tables, to_csv
    from nrdf.benchmark.store import LineStore
    from nrdf.field.weights import read_metadata
    from nrdf.field.zoo import find_weights

    path = find_weights(model)
    trained = str(read_metadata(path).get("category", ""))
    check_usable(method)
    check_views(views, points)
    specs = find_methods(method, trained, [str(path)], device=device)
    with errors.status("reading the objects"):
        found = read_objects(data, category)
    sets = {
        name: pairs_of(found, members)
        for name, members in group_categories((item.category for item in found), group).items()
    }
    pairs = [pair for of in sets.values() for pair in of]
    settings = Settings(data.resolve(), path.resolve(), points, normals, device)
    kept = None if out is None else LineStore(out, overwrite)
    with progress_bars(method) as progress:
        figures = evaluate_objects(
            settings, found, pairs, specs, views, workers or os.cpu_count() or 1, kept, progress
        )
    for title, parts, rows in tables(rows_of(figures, sets)):
        shown = table(title, "", *headings(parts))
        for row in rows:
            shown.add_row(row.method, *cells(row, parts))
        show(shown)
    if out is not None:
        from nrdf.ply import write_atomically

        write_atomically(out / "objects.csv", [to_csv(figures).encode()])
