"""Table III's trainings: without each loss of the last stage, and with all of them.

The stages before the last are the same in every variant, so they are trained once: `shared/` in the
output folder is a run that every variant begins from (`nrdf.training.loop.train`).
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from nrdf.errors import ConfigError, unknown_name
from nrdf.field.zoo import WEIGHTS
from nrdf.io.atomic import write_json
from nrdf.io.locks import write_lock
from nrdf.training.checkpoint import COST, IDENTITY, open_run
from nrdf.training.config import TrainConfig
from nrdf.training.loop import run_identity, train
from nrdf.training.provenance import list_shapes

log = logging.getLogger(__name__)

COMPLETE, SHARED = "complete", "shared"
OMITTED = {
    "cd": "chamfer",
    "emd": "emd",
    "ncd": "normal_consistency",
    "ds": "smoothness",
    "dd": "descriptor_distance",
}
"""Variant to the loss that it is trained without, by the paper's abbreviations."""
VARIANTS = (COMPLETE, *OMITTED)
SCHEDULES = {"short": "ablation-short", "full": "paper"}
"""Schedule to the configuration that it trains."""


def variant_config(config: TrainConfig, variant: str, seed: int = 0) -> TrainConfig:
    """The configuration with one loss fewer in its last stage, or as it is ("complete").

    seed: other than 0, that of the last stage's draws.

    Raises ConfigError for an unknown variant, and one whose loss the last stage does not have.
    """
    if variant not in VARIANTS:
        raise ConfigError(unknown_name("variant", variant, VARIANTS))
    stage, loss = config.stages[-1], OMITTED.get(variant)
    if loss is not None and loss not in stage.weights:
        raise ConfigError(
            f"variant '{variant}' leaves out '{loss}', which the last stage '{stage.name}' does "
            f"not have: {', '.join(stage.weights)}"
        )
    weights = {name: weight for name, weight in stage.weights.items() if name != loss}
    changes = {"weights": weights, "seed": seed or stage.seed}
    stages = [*config.stages[:-1], stage.model_copy(update=changes)]
    return config.model_copy(update={"stages": stages})


def shared_config(config: TrainConfig) -> TrainConfig:
    """The stages before the last. Raises ConfigError where there are none."""
    if len(config.stages) < 2:
        raise ConfigError("an ablation needs stages before the one that loses a loss; add one")
    return config.model_copy(update={"stages": config.stages[:-1]})


def train_variants(
    variants: Sequence[str],
    config: TrainConfig,
    data: Sequence[Path],
    out: Path,
    *,
    category: str,
    device: str = "auto",
    overwrite: bool = False,
    seeds: int = 1,
) -> dict[tuple[str, int], Path]:
    """Train what of the variants is not trained yet, each in a folder of `out`; the folders by
    variant and seed.

    The stages before the last are trained once, whatever the seed of the last. Started again after
    whatever ended it, it goes on. Other processes may train other variants in the same `out`
    meanwhile; one that wants the same run waits until it is done. Errors are those of
    `variant_config` and `nrdf.training.loop.train`.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) > 1:
        raise ConfigError(
            "an ablation does not run under torchrun; start one command for each device, each "
            "with some of the variants"
        )
    settings = {
        (name, seed): variant_config(config, name, seed)
        for seed in range(seeds)
        for name in variants
    }
    shapes = [entry.path.stem for entry in list_shapes(data) if entry.split == "train"]

    def run(name: str, wanted: TrainConfig, begin: Path | None, what: str) -> None:
        folder = out / name
        with turn(out, name):
            identity = run_identity(wanted, category, shapes)
            if open_run(folder, identity, overwrite) and (folder / WEIGHTS).is_file():
                log.info("%s: trained already", what)
                return
            log.info("%s: training", what)
            with _timed(folder):
                train(wanted, data, folder, category=category, device=device, begin=begin)

    run(SHARED, shared_config(config), None, "stages that all variants share")
    folders = {}
    for number, ((name, seed), wanted) in enumerate(settings.items(), 1):
        folder = f"{name}-seed-{seed}" if seed else name
        run(folder, wanted, out / SHARED, f"{describe(name)} ({number} of {len(settings)})")
        folders[name, seed] = out / folder
    return folders


def describe(variant: str) -> str:
    """A variant in words: "all losses", "without CD" or "without the last stage"."""
    if variant == SHARED:
        return "without the last stage"
    return "all losses" if variant == COMPLETE else f"without {variant.upper()}"


def read_cost(run: Path) -> float:
    """Seconds that a run of `train_variants` has taken so far, over all its interruptions."""
    try:
        return float(json.loads((run / COST).read_text(encoding="utf-8"))["seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return 0.0


@contextmanager
def _timed(run: Path) -> Iterator[None]:
    before, start = read_cost(run), time.perf_counter()
    try:
        yield
    finally:
        if (run / IDENTITY).is_file():
            seconds = before + time.perf_counter() - start
            write_json(run / COST, {"seconds": round(seconds, 3)})


def turn(out: Path, name: str) -> AbstractContextManager[None]:
    """Other processes that want to train or score the same run of `out` wait meanwhile."""
    return write_lock(out / f"turn at {name}", wait=True)
