"""Training of the small networks beside a field: minutes on one core, gone on with when killed."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from nrdf.field.device import choose_precision
from nrdf.field.weights import save_weights
from nrdf.field.zoo import WEIGHTS
from nrdf.io.atomic import output_errors
from nrdf.io.locks import write_lock
from nrdf.training.checkpoint import (
    METRICS,
    Position,
    latest_checkpoint,
    load_field_state,
    load_optimizer_state,
    open_run,
    read_position,
    save_checkpoint,
    write_identity,
)
from nrdf.training.distributed import Workers
from nrdf.training.provenance import environment

log = logging.getLogger(__name__)

CHECKPOINT_EVERY = 200
_WARM_UP = 50  # steps


@dataclass(frozen=True)
class Settings:
    """steps of `batch` clouds; rate: the highest of a cosine; noise, canonical, of points; seed."""

    steps: int = 1000
    batch: int = 48
    rate: float = 2e-3
    noise: float = 0.004
    seed: int = 0


@contextmanager
def small_run(
    preset: str,
    config: Any,
    category: str,
    settings: Settings,
    shapes: Sequence[str],
    out: Path,
    overwrite: bool,
) -> Iterator[None]:
    """Begin a run of this preset in `out`, or go on with the same one; no other run writes there
    meanwhile. Raises OutputError for a folder that holds something else."""
    identity = {
        preset: asdict(settings),
        "network": config.model_dump(mode="json"),
        "category": category,
        "shapes": list(shapes),
    }
    with write_lock(out):
        if not open_run(out, identity, overwrite):
            write_identity(out, identity, environment(_alone()))
        yield


def run_steps(
    network: nn.Module,
    settings: Settings,
    loss_at: Callable[[torch.Generator], Tensor],
    out: Path,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Take the steps that are missing; `loss_at` draws what it needs and gives a step's loss.

    The network is left in evaluation mode.
    """
    optimizer = torch.optim.AdamW(network.parameters(), settings.rate, weight_decay=0.02)
    checkpoint, done = latest_checkpoint(out), 0
    if checkpoint is not None:
        done = read_position(checkpoint).total
        load_field_state(checkpoint, network)
        load_optimizer_state(checkpoint, optimizer)
        log.info("going on from step %d of %d", done, settings.steps)
    network.train()
    mean = 0.0
    for step in range(done, settings.steps):
        generator = torch.Generator().manual_seed(settings.seed * 1_000_003 + step)
        torch.manual_seed(settings.seed * 1_000_003 + step)  # for dropout
        warm = min(1.0, (step + 1) / _WARM_UP)
        rate = settings.rate * warm * 0.5 * (1 + math.cos(math.pi * step / settings.steps))
        for group in optimizer.param_groups:
            group["lr"] = rate
        loss = loss_at(generator)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        mean += (float(loss.detach()) - mean) * (0.02 if step > done else 1.0)
        if (step + 1) % CHECKPOINT_EVERY == 0 or step + 1 == settings.steps:
            save_checkpoint(out, Position(0, step + 1, step + 1), network, optimizer, None)
            path = out / METRICS
            with output_errors(path), open(path, "a", encoding="utf-8") as file:
                file.write(json.dumps({"step": step + 1, "loss": round(mean, 4)}) + "\n")
        if progress is not None:
            progress(step + 1, settings.steps)
    network.eval()


def write_small_network(
    out: Path,
    network: Any,
    category: str,
    settings: Settings,
    shapes: Mapping[str, Any],
    scores: Mapping[str, float],
) -> Path:
    """The run's weight file, with its provenance; its path."""
    path = out / WEIGHTS
    metadata = {
        "category": category,
        "train": asdict(settings),
        "shapes": shapes,
        "scores": scores,
        "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        **environment(_alone()),
    }
    save_weights(path, network, metadata)
    return path


def fastest() -> torch.autocast:
    """A context in which networks run in the precision that is fastest on this CPU."""
    precision = choose_precision("auto", torch.device("cpu"))
    return torch.autocast("cpu", precision, precision != torch.float32)


def _alone() -> Workers:
    return Workers(0, 1, torch.device("cpu"))
