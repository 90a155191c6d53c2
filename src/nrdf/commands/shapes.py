"""`nrdf synth`, `nrdf prepare`, `nrdf correspond`: training shapes and their correspondences."""

from __future__ import annotations

import os
from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar


def synth(
    category: Positional[str],
    count: int,
    out: Path,
    seed: int = 0,
    workers: int | None = None,
) -> None:
    """Make parametric training shapes, when one has no data: chair, car, plane or table.

    Each comes with exact occupancy and the exact corresponding points on all the others. Started
    again, it goes on where it was; a larger count adds to a smaller one.

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


def correspond(
    data: Positional[tuple[Path, ...]],
    templates: int = 12,
    workers: int | None = None,
) -> None:
    """Add dense correspondences between all shapes of data folders, by registering templates.

    A few shapes that stand for all are registered to every one (about 0.2 s a pair on one core).
    Started again, it goes on where it was.

    Example: nrdf correspond data/chair --templates 10

    Args:
        data: Data folders of one category (of `nrdf prepare` or `nrdf synth`).
        templates: Number of shapes that serve as templates.
        workers: Processes; all cores unless given.
    """
    from nrdf.shapes.correspond import correspond_folders

    with progress_bar("shapes registered") as progress:
        report = correspond_folders(list(data), templates, _cores(workers), progress=progress)
    console.print(
        f"{report.done} shapes registered, {report.skipped} were before; "
        f"templates: {', '.join(report.templates)}"
    )


def _cores(workers: int | None) -> int:
    return workers or os.cpu_count() or 1
