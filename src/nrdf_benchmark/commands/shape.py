"""`nrdf eval shape`: how well fields know the shapes themselves (the paper's Table I)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from nrdf.commands.console import command_line, console, progress_bars, versions
from nrdf.commands.options import Cluster, Folder
from nrdf.commands.output_lock import lock_output
from nrdf.io.bounds import Bounds, Count, Fraction
from nrdf.tasks import chosen_workers


@lock_output("out")
def shape(
    data: Folder,
    method: tuple[str, ...] = ("nrdf",),
    model: tuple[str, ...] = (),
    runs: Folder = Path("runs"),
    split: Literal["test", "val", "train"] = "test",
    level: Fraction = 0.75,
    resolution: Annotated[int, Bounds(2, 1024)] = 64,
    points: Count = 8192,
    device: str = "cpu",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    out: Folder | None = None,
) -> None:
    """The paper's Table I: surface and occupancy of shapes not trained on.

    CD-L1 between the field's surface (marching cubes, occupancy 0.75) and the input cloud, in the
    paper's convention, and the mean squared error of occupancy over the shapes' stored queries.

    Example: nrdf eval shape --data data/chair --method nrdf ndf imdc --out results/

    Args:
        data: A data folder of one category (of `nrdf model prepare --index`, with a test split).
        method: Methods to score, rows of the table: nrdf, nrdf-paper, ndf, imdc.
        model: METHOD=PATH of a weight file or run; a zoo name or path alone is for nrdf, which
            otherwise has the category's model in the zoo.
        runs: Where the others were trained: RUNS/CATEGORY-PRESET, presets paper, ndf, imdc;
            what is not there comes with the benchmark, where it is small enough.
        split: Which shapes to score: test, val or train.
        level: Occupancy of the surface.
        resolution: Nodes of the grid along each axis.
        points: Points drawn on the surface, and taken of the cloud.
        device: cpu, cuda, cuda:N or auto.
        workers: Processes; all cores unless given, one on a GPU.
        cluster: Address of a Dask scheduler whose workers do it instead.
        out: Folder for the table (Markdown), every shape's figures (CSV, JSON), and a picture of
            some surfaces (PNG).
    """
    from nrdf.training.provenance import git_commit
    from nrdf_benchmark.methods.registry import find_methods
    from nrdf_benchmark.shape import (
        Settings,
        check_methods,
        evaluate_shapes,
        find_shapes,
        table,
        write_results,
    )
    from nrdf_benchmark.shape_picture import draw_surfaces

    check_methods(method)
    category, paths = find_shapes(data, split)
    specs = find_methods(method, category, model, runs, device)
    settings = Settings(level, resolution, points)
    cores = chosen_workers(workers, cluster, None if device == "cpu" else 1)
    with progress_bars(method) as progress:
        results = evaluate_shapes(category, paths, specs, settings, cores, progress)
    if out is not None:
        origin = {"command": command_line(), "versions": versions(), "commit": git_commit()}
        extra = {**origin, "seed": 0, "split": split}
        for path in write_results(results, category, settings, out, extra):
            console.print(f"wrote {path}")
        picture = out / f"table1-{category}.png"
        draw_surfaces(paths, specs, settings, picture)
        console.print(f"wrote {picture}")
    console.print(table(results, category, settings))
