"""`nrdf model kind`: the network that checks an object's kind and how it is turned."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import Folder, Metavar


def kind(
    category: Positional[str],
    data: tuple[Folder, ...],
    out: Folder | None = None,
    others: tuple[Folder, ...] = (),
    leave_out: tuple[Annotated[str, Metavar("WORD")], ...] = (),
    others_licence: str = "not stated",
    steps: int = 1200,
    seed: int = 0,
    overwrite: bool = False,
) -> None:
    """Train the network that tells whether an object is of a category, and upright.

    It is trained on simulated views of training shapes in every orientation, and of objects of
    other kinds, on the CPU, in a few minutes. Killed at any moment, the same command goes on.
    `nrdf model add` makes it the one that targets of the category are checked by.

    Example: nrdf model kind chair --data data/chair data/chair-family --others data/car data/plane
    meshes/ --leave-out chair stool bench --out runs/chair-kind

    Args:
        category: What the shapes are; all of them must be of it.
        data: Data folders (of `nrdf model prepare`, `synth` or `boxes`).
        out: The run's folder; runs/CATEGORY-kind unless given.
        others: What else there is: data folders of other categories, and folders of meshes, +Y up,
            any heading; half of the meshes are kept for `nrdf eval kind`.
        leave_out: Meshes with one of these words in their names are of the category: not shown.
        others_licence: Licence of the meshes of other kinds, which the weights' metadata name.
        steps: Steps of training, about 0.2 s each.
        seed: Seed of the first weights and of everything drawn.
        overwrite: Start anew in a folder that holds another run.
    """
    from nrdf.field.weights import read_metadata
    from nrdf.training.kind_network import KindSettings, train_kind

    settings = KindSettings(steps=steps, seed=seed, others_licence=others_licence)
    folder = out or Path("runs") / f"{category}-kind"
    with progress_bar("steps") as progress:
        weights = train_kind(
            category, data, others, folder, leave_out, settings, overwrite, progress
        )
    scores = read_metadata(weights)["scores"]
    console.print(
        f"wrote {weights}; of clouds of other shapes, {scores['members-refused']:.1%} are refused "
        f"wrongly, {scores['others-passed']:.1%} pass wrongly"
    )
