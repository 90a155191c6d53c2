"""`nrdf model yaw`: the network that tells which way a category's objects face."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console, progress_bar
from nrdf.commands.options import Folder
from nrdf.io.bounds import Count, Seed


def yaw(
    category: Positional[str],
    data: tuple[Folder, ...],
    out: Folder | None = None,
    steps: Count = 1000,
    seed: Seed = 0,
    overwrite: bool = False,
) -> None:
    """Train the network that tells which way scans of a category face.

    Alignment uses it. It is trained on simulated views of training shapes, on the CPU, in a few
    minutes. Killed at any moment, the same command goes on. `nrdf model add` makes it the one that
    alignment uses for the category.

    Example: nrdf model yaw chair --data data/chair data/chair-family --out runs/chair-yaw

    Args:
        category: What the shapes are; all of them must be of it.
        data: Data folders (of `nrdf model prepare`, `synth` or `boxes`).
        out: The run's folder; runs/CATEGORY-yaw unless given.
        steps: Steps of training, about 0.15 s each.
        seed: Seed of the first weights and of everything drawn.
        overwrite: Start anew in a folder that holds another run.
    """
    from nrdf.field.weights import read_metadata
    from nrdf.training.yaw_network import YawSettings, train_yaw

    folder = out or Path("runs") / f"{category}-yaw"
    with progress_bar("steps") as progress:
        settings = YawSettings(steps=steps, seed=seed)
        weights = train_yaw(category, list(data), folder, settings, overwrite, progress)
    wrong = read_metadata(weights)["scores"]["wrong-yaws"]
    console.print(f"wrote {weights}; {100 * wrong:.1f} % of views of other shapes are told wrongly")
