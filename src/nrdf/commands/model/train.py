"""`nrdf model train`: weights of one category from training shapes."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console
from nrdf.commands.options import File, Folder


def train(
    category: Positional[str],
    data: tuple[Folder, ...],
    preset: str = "default",
    config: File | None = None,
    start: str | None = None,
    device: str = "auto",
    out: Folder | None = None,
    overwrite: bool = False,
) -> None:
    """Train a field; killed at any moment, the same command goes on.

    Writes checkpoints, metrics.jsonl, TensorBoard scalars (with nrdf[train]), and at the end
    weights.safetensors, which `--model` of the other verbs takes. On several GPUs:
    torchrun --nproc-per-node 4 -m nrdf.cli model train ...

    Example: nrdf model train chair --data data/chair --preset default --device auto

    Args:
        category: What the shapes are; all of them must be of it, but for `general`: the model that
            serves every category, whose occupancy (--preset occupancy) any shapes teach.
        data: Data folders (of `nrdf model prepare`, `synth` or `boxes`).
        preset: default, chair, occupancy, paper, ndf, imdc, or one of the last three with -short:
            the configuration of that name, whose file says what it costs.
        config: A configuration file of your own, instead of a preset.
        start: Zoo name, weight file or run whose weights training begins with; it must be of the
            configuration's preset and sizes. Fresh ones unless given.
        device: auto (CUDA where there is one), cpu, cuda or cuda:N.
        out: The run's folder; runs/CATEGORY unless given.
        overwrite: Start anew in a folder that holds another run.
    """
    from nrdf.training.config import load_config
    from nrdf.training.loop import train as run

    out = out or Path("runs") / category
    settings = load_config(config if config is not None else preset)
    weights = run(
        settings,
        list(data),
        out,
        category=category,
        device=device,
        overwrite=overwrite,
        start=start,
    )
    console.print(f"wrote {weights}; use it with --model {weights}")
