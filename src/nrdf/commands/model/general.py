"""`nrdf model general`: the field for objects of every category."""

from __future__ import annotations

from pathlib import Path

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import Folder


def general(
    data: tuple[Folder, ...],
    out: Folder = Path("runs/general"),
    steps: int = 7000,
    kinds: int = 1400,
    families: tuple[str, ...] = ("chair",),
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Train the field for objects of every category.

    On pairs with exact truth, made as it goes: members of kinds that are put together at random,
    members of the parametric families, and deformed copies of the shapes of data folders, whatever
    they are. About 0.7 s a step on one core. Killed at any moment, the same command goes on.
    To measure it on a category, keep that out of the data and of the families (`nrdf eval unseen`).

    Example: nrdf model general --data data/objects data/chair --out runs/general

    Args:
        data: Data folders (of `nrdf model prepare`): shapes of any kind.
        out: The run's folder.
        steps: Steps of training, of 16 pairs each.
        kinds: Random kinds of objects.
        families: Parametric families that are shown as well: chair, car, plane, table.
        seed: Seed of the first weights and of everything drawn.
        overwrite: Start anew in a folder that holds another run.
    """
    from nrdf.field.weights import read_metadata
    from nrdf.training.general_field import GeneralSettings, train_general

    settings = GeneralSettings(steps=steps, seed=seed, kinds=kinds, families=families)
    with progress_bar("steps") as progress:
        weights = train_general(data, out, settings, None, overwrite, progress)
    error = read_metadata(weights)["scores"]["assemblies"]
    console.print(f"wrote {weights}; on kinds never seen a place is off by {error:.1%} of the size")
