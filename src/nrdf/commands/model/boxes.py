"""`nrdf model boxes`: training shapes from objects given as oriented boxes."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import File, Folder
from nrdf.io.bounds import Count, Seed


def boxes(
    file: Positional[File],
    category: str,
    count: Count,
    out: Folder | None = None,
    seed: Seed = 0,
    licence: str = "",
) -> None:
    """Make training shapes of objects given as oriented boxes.

    PartNet's part boxes, for instance. Real proportions and structure, no curved detail. Objects
    whose boxes hold mostly air are left out. Started again, it goes on where it was.

    Example: nrdf model boxes chair_boxes.npz --category chair --count 400

    Args:
        file: .npz with center, axes, size, label and offset.
        category: What the objects are.
        count: Number of shapes, drawn by the seed; every 20th is for validation.
        out: Data folder to write or to go on with; data/CATEGORY-boxes unless given.
        seed: Seed of the draw.
        licence: Terms of the boxes, kept with the shapes and the weights trained on them.
    """
    from nrdf.io.locks import write_lock
    from nrdf.shapes.boxes import prepare_boxes

    folder = out or Path("data") / f"{category}-boxes"
    with write_lock(folder), progress_bar("shapes from boxes") as progress:
        made = prepare_boxes(file, folder, category, count, seed, licence, progress)
    console.print(f"{made} shapes in {folder}")
