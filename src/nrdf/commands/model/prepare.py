"""`nrdf model prepare`: training shapes from meshes."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, errors, progress_bar
from nrdf.commands.options import Cluster, File, Folder
from nrdf.io.bounds import Count, Seed
from nrdf.tasks import chosen_workers


def prepare(
    meshes: Positional[Folder],
    category: str,
    out: Folder | None = None,
    index: File | None = None,
    surface_points: Count = 8192,
    queries: Count = 16384,
    seed: Seed = 0,
    workers: Count | None = None,
    cluster: Cluster | None = None,
    overwrite: bool = False,
) -> int:
    """Make training shapes from meshes of any quality.

    Each gets points on its visible skin, outward normals, and occupancy queries. A mesh that cannot
    be used is named with the reason, the others go on, and the exit code is 1. Started again, it
    goes on where it was.

    Example: nrdf model prepare meshes/ --category chair --out data/chair

    Args:
        meshes: Folder of meshes (PLY, OBJ, OFF, STL, GLB, ...): +X forward, +Y up; any unit.
        category: What the meshes are.
        out: Data folder to write or to go on with; data/CATEGORY unless given.
        index: Table with the columns name, source, split and licence; index.csv beside the meshes
            unless given. Without one, one shape in 20 is for validation.
        surface_points: Points on each shape's surface.
        queries: Occupancy queries of each shape, half of them near the surface.
        seed: Seed of the points and queries.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
        overwrite: Make again what is there already.
    """
    from nrdf.io.locks import write_lock
    from nrdf.shapes.prepare import PrepareSettings, prepare_folder

    settings = PrepareSettings(surface_points, queries, seed)
    folder, cores = out or Path("data") / category, chosen_workers(workers, cluster)
    with write_lock(folder), progress_bar("meshes") as progress:
        report = prepare_folder(
            meshes, folder, category, index, settings, cores, overwrite, progress
        )
    console.print(
        f"{len(report.made)} shapes made, {len(report.kept)} were there already, in {folder}"
    )
    for name, reason in sorted(report.failed.items()):
        errors.print(f"not used: {name}: {reason}", style="yellow")
    return report.exit_code
