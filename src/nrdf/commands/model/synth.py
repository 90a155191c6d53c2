"""`nrdf model synth`: training shapes from a parametric family."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import Cluster, Folder
from nrdf.io.bounds import Count, Seed
from nrdf.tasks import chosen_workers


def synth(
    category: Positional[str],
    count: Count,
    out: Folder | None = None,
    seed: Seed = 0,
    workers: Count | None = None,
    cluster: Cluster | None = None,
) -> None:
    """Make parametric training shapes: chair, car, plane or table.

    For when there are no meshes. Each shape has exact occupancy and the exact corresponding points
    on all others. Started again, it goes on where it was; a larger count adds to a smaller one.

    Example: nrdf model synth chair --count 500 --out data/chair-family

    Args:
        category: chair, car, plane or table.
        count: Number of shapes; every 20th is for validation.
        out: Data folder to write or to go on with; data/CATEGORY-family unless given.
        seed: Seed of the first shape; shape i has the seed seed + i.
        workers: Processes; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do it instead.
    """
    from nrdf.io.locks import write_lock
    from nrdf.shapes.synth import synthesise

    folder = out or Path("data") / f"{category}-family"
    with write_lock(folder), progress_bar(f"{category} shapes") as progress:
        made = synthesise(category, count, folder, seed, chosen_workers(workers, cluster), progress)
    console.print(f"{made} shapes made, {count - made} were there already, in {folder}")
