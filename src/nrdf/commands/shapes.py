"""`nrdf synth`, `prepare`, `boxes` and `correspond`: training shapes and their correspondences."""

from __future__ import annotations

import os
from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, errors, progress_bar
from nrdf.commands.one_run import one_run_at
from nrdf.io.bounds import Count, Seed


@one_run_at("out")
def synth(
    category: Positional[str],
    count: Count,
    out: Path,
    seed: Seed = 0,
    workers: Count | None = None,
) -> None:
    """Make parametric training shapes: chair, car, plane or table.

    For when one has no data. Each comes with exact occupancy and the exact corresponding points on
    all the others. Started again, it goes on where it was; a larger count adds to a smaller one.

    Example: nrdf synth chair --count 500 --out data/chair

    Args:
        category: chair, car, plane or table.
        count: Number of shapes; every 20th is for validation.
        out: Data folder to write or to go on with.
        seed: Seed of the first shape; shape i has the seed seed + i.
        workers: Processes; all cores unless given.
    """
    from nrdf.shapes.synth import synthesise

    with progress_bar(f"{category} shapes") as progress:
        made = synthesise(category, count, out, seed, _cores(workers), progress)
    console.print(f"{made} shapes made, {count - made} were there already, in {out}")


@one_run_at("out")
def prepare(
    meshes: Positional[Path],
    category: str,
    out: Path,
    index: Path | None = None,
    surface_points: Count = 8192,
    queries: Count = 16384,
    seed: Seed = 0,
    workers: Count | None = None,
    overwrite: bool = False,
) -> int:
    """Make training shapes from meshes of any quality.

    Each gets points on its visible skin, outward normals, and occupancy queries. A mesh that cannot
    be used is named with the reason, the others go on, and the exit code is 1. Started again, it
    goes on where it was.

    Example: nrdf prepare meshes/ --category chair --out data/meshes

    Args:
        meshes: Folder of meshes (PLY, OBJ, OFF, STL, GLB, ...): +X forward, +Y up; any unit.
        category: What the meshes are.
        out: Data folder to write or to go on with.
        index: Table with the columns name, source, split and licence; index.csv beside the meshes
            unless given. Without one, one shape in 20 is for validation.
        surface_points: Points on each shape's surface.
        queries: Occupancy queries of each shape, half of them near the surface.
        seed: Seed of the points and queries.
        workers: Processes; all cores unless given.
        overwrite: Make again what is there already.
    """
    from nrdf.shapes.prepare import Settings, prepare_folder

    settings = Settings(surface_points, queries, seed)
    with progress_bar("meshes") as progress:
        report = prepare_folder(
            meshes, out, category, index, settings, _cores(workers), overwrite, progress
        )
    console.print(
        f"{len(report.made)} shapes made, {len(report.kept)} were there already, in {out}"
    )
    for name, reason in sorted(report.failed.items()):
        errors.print(f"not used: {name}: {reason}", style="yellow")
    return report.exit_code


@one_run_at("out")
def boxes(
    file: Positional[Path],
    category: str,
    count: Count,
    out: Path,
    seed: Seed = 0,
    licence: str = "",
) -> None:
    """Make training shapes of objects given as oriented boxes.

    PartNet's part boxes, for instance. Real proportions and structure, no curved detail. Objects
    whose boxes hold mostly air are left out. Started again, it goes on where it was.

    Example: nrdf boxes chair_boxes.npz --category chair --count 400 --out data/chair-boxes

    Args:
        file: .npz with center, axes, size, label and offset.
        category: What the objects are.
        count: Number of shapes, drawn by the seed; every 20th is for validation.
        out: Data folder to write or to go on with.
        seed: Seed of the draw.
        licence: Terms of the boxes, kept with the shapes and the weights trained on them.
    """
    from nrdf.shapes.boxes import prepare_boxes

    with progress_bar("boxed shapes") as progress:
        made = prepare_boxes(file, out, category, count, seed, licence, progress)
    console.print(f"{made} shapes in {out}")


@one_run_at("data")
def correspond(
    data: Positional[tuple[Path, ...]],
    templates: Count = 12,
    templates_from: Path | None = None,
    meshes: Path | None = None,
    workers: Count | None = None,
) -> None:
    """Add correspondences between shapes, by registering templates.

    A few shapes that stand for all are registered to every one (about 0.2 s a pair on one core).
    Started again, it goes on where it was.

    Example: nrdf correspond data/chair --templates 10

    Args:
        data: Data folders of one category (of `nrdf prepare` or `nrdf synth`).
        templates: Number of shapes that serve as templates; all shapes where there are fewer.
        templates_from: The folder whose shapes may serve as templates; all of them unless given.
            Boxes, for instance, are good to learn from and poor as templates.
        meshes: Folder of the meshes that the first data folder was prepared from: those that share
            their triangulation get exact correspondences too, vertex by vertex.
        workers: Processes; all cores unless given.
    """
    from nrdf.shapes.correspond import correspond_folders
    from nrdf.shapes.topology import add_shared_topology

    if meshes is not None:
        for name, shapes in add_shared_topology(meshes.iterdir(), data[0]).items():
            console.print(f"{len(shapes)} shapes share their triangulation: group {name}")
    with progress_bar("shapes registered") as progress:
        report = correspond_folders(
            list(data), templates, _cores(workers), None, progress, templates_from
        )
    console.print(
        f"{report.done} shapes registered, {report.skipped} were before; "
        f"templates: {', '.join(report.templates)}"
    )


def _cores(workers: int | None) -> int:
    return workers or os.cpu_count() or 1
