"""`nrdf train`: weights of one category from training shapes."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from nrdf.commands.console import console


def train(
    category: Positional[str],
    data: tuple[Path, ...],
    preset: str = "default",
    config: Path | None = None,
    device: str = "auto",
    out: Path | None = None,
    overwrite: bool = False,
) -> None:
    """Train a field; killed at any moment, the same command goes on.

    Writes checkpoints, metrics.jsonl, TensorBoard scalars (with nrdf[train]), and at the end
    weights.safetensors, which `--model` of the other verbs takes. On several GPUs:
    torchrun --nproc-per-node 4 -m nrdf.cli train ...

    Example: nrdf train chair --data data/chair --preset default --device auto --out runs/chair

    Args:
        category: What the shapes are; all of them must be of it.
        data: Data folders (of `nrdf prepare` or `nrdf synth`).
        preset: default, chair, car, paper, ndf, imdc, or one of the last three with -short:
            the configuration of that name, whose file says what it costs.
        config: A configuration file of your own, instead of a preset.
        device: auto (CUDA where there is one), cpu, cuda or cuda:N.
        out: The run's folder; runs/CATEGORY unless given.
        overwrite: Start anew in a folder that holds another run.
    """
    from nrdf.training.config import load_config
    from nrdf.training.loop import train as run

    out = out or Path("runs") / category
    settings = load_config(config if config is not None else preset)
    weights = run(settings, list(data), out, category=category, device=device, overwrite=overwrite)
    console.print(f"wrote {weights}; use it with --model {weights}")
