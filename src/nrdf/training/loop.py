"""The one training loop, for every preset."""

from __future__ import annotations

import hashlib
import logging
import math
import signal
import threading
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from nrdf.errors import ConfigError, DataError, TrainingError, unknown_name
from nrdf.field import build_field
from nrdf.field.base import Field
from nrdf.field.device import choose_precision
from nrdf.field.general import GENERAL
from nrdf.field.weights import save_weights
from nrdf.field.zoo import find_weights
from nrdf.io.locks import write_lock
from nrdf.training.batch import Batch, seeded
from nrdf.training.checkpoint import (
    Position,
    common_checkpoint,
    latest_checkpoint,
    load_field_state,
    load_optimizer_state,
    open_run,
    read_position,
    save_checkpoint,
    write_identity,
)
from nrdf.training.config import Stage, TrainConfig
from nrdf.training.dataset import ShapeDataset, load_dataset
from nrdf.training.distributed import Workers, join_workers
from nrdf.training.losses import LOSSES, LossContext
from nrdf.training.optimizer import make_optimizer
from nrdf.training.progress import Display
from nrdf.training.provenance import environment, list_shapes, provenance
from nrdf.training.validation import ignores_embedding, validate
from nrdf.training.weights import averaged, start_parts, start_with, to_device, update_average

log = logging.getLogger(__name__)

MAX_SKIPPED = 5
"""Steps without a finite gradient, one after the other, before a run gives up."""


def train(
    config: TrainConfig,
    data: Sequence[str | Path],
    out: str | Path,
    *,
    category: str,
    device: str = "auto",
    overwrite: bool = False,
    begin: str | Path | None = None,
    start: str | Path | None = None,
) -> Path:
    """Train a field for one category, or for "general" of any, and export its weights; returns the
    weight file's path.

    `data` are folders with an `index.csv`, `out` is the run's folder. Started again with the same
    arguments after whatever ended it, a run goes on from its newest checkpoint, to the same
    weights, bit by bit, that it would have reached undisturbed (on the same device, with as many
    threads and processes). So does a run that starts with the newest checkpoint of another run,
    `begin`, which must have come there by the same settings, stages and shapes.

    start: a model whose weights the run starts with, as `nrdf.load_model` takes it; it must be of
    the same preset and sizes. Fresh ones unless given.

    Raises ConfigError, DataError (no shapes, another category), OutputError (the folder holds
    something else, or cannot be written) and TrainingError (the loss stayed infinite or NaN).
    """
    out = Path(out)
    check_parts(config, build_field(config.preset, config.field))
    with join_workers(device) as workers, write_lock(out) if workers.first else nullcontext():
        entries = list_shapes([Path(folder) for folder in data])
        dataset = load_dataset(entries, "train", config.data, workers.device)
        if category != GENERAL and dataset.categories != {category}:
            found = ", ".join(sorted(dataset.categories))
            raise DataError(f"the shapes are of category {found}, not {category}")
        validation = None
        if workers.first and any(entry.split == "val" for entry in entries):
            validation = load_dataset(entries, "val", config.data, workers.device)
        identity = run_identity(config, category, dataset.names, start)
        shared = None if begin is None else common_checkpoint(Path(begin), identity)
        if workers.first and not open_run(out, identity, overwrite):
            write_identity(out, identity, environment(workers))
        workers.wait()
        field, scores = run_stages(config, dataset, out, workers, validation, shared, start)
        path = out / "weights.safetensors"
        if workers.first:
            save_weights(
                path,
                field,
                {
                    "category": "" if category == GENERAL else category,
                    "train": config.model_dump(mode="json"),
                    "shapes": provenance(entries),
                    "scores": scores,
                    "date": datetime.now(timezone.utc).isoformat(timespec="seconds"),
                    **{key: identity[key] for key in ("start", "start_parts") if key in identity},
                    **environment(workers),
                },
            )
            log.info("wrote %s", path)
        workers.wait()
    return path


def run_identity(
    config: TrainConfig, category: str, shapes: Sequence[str], start: str | Path | None = None
) -> dict[str, Any]:
    """What makes a run the same run; `shapes` are the names of the training shapes, in order, and
    `start` the model that it starts with."""
    content = config.model_dump(mode="json")
    identity = {"config": content, "category": category, "shapes": list(shapes)}
    if start is not None:
        identity["start"] = _file_identity(start)
    if config.start_parts:
        found = {name: _file_identity(model) for name, model in config.start_parts.items()}
        identity["start_parts"] = found
    return identity


def _file_identity(model: str | Path) -> dict[str, str]:
    file = find_weights(model)
    return {"file": file.name, "sha256": hashlib.sha256(file.read_bytes()).hexdigest()}


def run_stages(
    config: TrainConfig,
    dataset: ShapeDataset,
    out: Path,
    workers: Workers,
    validation: ShapeDataset | None,
    begin: Path | None = None,
    start: str | Path | None = None,
) -> tuple[Field, dict[str, float]]:
    """All stages from wherever the run stands, or from the checkpoint `begin` where it has none;
    the field to export (the average, if one is kept) and its scores on the validation shapes. A new
    run begins with the weights of the model `start`."""
    torch.manual_seed(config.seed)
    field = build_field(config.preset, config.field).to(workers.device)
    lengths = [
        stage_steps(stage, dataset.for_stage(stage), workers.world) for stage in config.stages
    ]
    precision = choose_precision(config.precision, workers.device)

    checkpoint = latest_checkpoint(out) or begin
    if checkpoint is None:
        if start is not None:
            start_with(field, start)
        start_parts(field, config.start_parts)
    position = Position() if checkpoint is None else read_position(checkpoint)
    average = None if checkpoint is None else load_field_state(checkpoint, field)
    if config.ema is not None:
        average = to_device(average or field.state_dict(), workers.device)
    if checkpoint is not None:
        log.info("going on from step %d of %d", position.total, sum(lengths))

    with (
        Display(out, sum(lengths), position.total, workers.first) as display,
        deferred_interrupt(workers.world == 1) as interrupted,
    ):
        for number, (stage, length) in enumerate(zip(config.stages, lengths, strict=True)):
            if number < position.stage:
                continue
            if position.stage < number:
                position, checkpoint = Position(number, 0, position.total), None
            drawn = dataset.for_stage(stage)
            base = config.seed if stage.seed is None else stage.seed
            parameters = select_parts(field, stage)
            optimizer = make_optimizer(field, stage, config.optimizer)
            if checkpoint is not None:
                load_optimizer_state(checkpoint, optimizer)
            objective: nn.Module = Objective(field, stage, config, precision)
            if workers.world > 1:
                objective = DistributedDataParallel(objective, find_unused_parameters=True)
            sums: defaultdict[str, Tensor | float] = defaultdict(float)
            counted, skipped = 0, 0

            for step in range(position.step, length):
                seed = base + 7919 * number
                batch = drawn.batch(stage.batch_size, seed, step, workers.rank, workers.world)
                # Dropout and the like draw from the global generator.
                torch.manual_seed(base * 1_000_003 + position.total)
                generator = seeded(workers.device, seed, step, workers.rank, 1)
                for group in optimizer.param_groups:
                    group["lr"] = learning_rate(stage, step, length)

                total, terms = objective(batch, generator)
                optimizer.zero_grad(set_to_none=True)
                total.backward()
                norm = nn.utils.clip_grad_norm_(parameters, config.optimizer.clip or math.inf)
                # The norm is of gradients averaged over processes: all of them decide alike.
                if math.isfinite(norm.item()):
                    optimizer.step()
                    skipped = 0
                else:
                    skipped += 1
                    log.warning("%s", not_finite(stage, position.total, terms))
                    if skipped >= MAX_SKIPPED:
                        raise TrainingError(
                            f"{not_finite(stage, position.total, terms)}, and so were the "
                            f"{MAX_SKIPPED - 1} steps before; lower the stage's rate, set "
                            "optimizer.clip, or use precision: float32"
                        )
                if average is not None and config.ema is not None:
                    update_average(average, field, config.ema, position.total)

                position = Position(number, step + 1, position.total + 1)
                last = step + 1 == length
                counted += 1
                for name, value in terms.items():
                    sums[name] = sums[name] + value
                if position.total % config.log_every == 0 or last:
                    means = {f"loss/{name}": float(v) / counted for name, v in sums.items()}
                    means["rate"] = optimizer.param_groups[0]["lr"]
                    display.report(stage.name, position.total, means)
                    sums, counted = defaultdict(float), 0
                if validation is not None and position.total % config.validate_every == 0:
                    with averaged(field, average):
                        scores = validate(field, validation)
                    display.report(stage.name, position.total, scores)
                    if ignores_embedding(scores):
                        log.warning(
                            "step %d: occupancy is as good with another shape's embedding, so the "
                            "field knows no shape yet; if that stays so, train at a lower rate",
                            position.total,
                        )
                if workers.first and (
                    position.total % config.checkpoint_every == 0 or last or interrupted.is_set()
                ):
                    save_checkpoint(out, position, field, optimizer, average)
                if interrupted.is_set():
                    raise KeyboardInterrupt

    if average is not None:
        field.load_state_dict(average)
    field.requires_grad_(True).eval()
    return field, validate(field, validation) if validation is not None else {}


class Objective(nn.Module):
    """The weighted sum of a stage's losses, as a module so that processes can share it."""

    def __init__(
        self, field: Field, stage: Stage, config: TrainConfig, precision: torch.dtype
    ) -> None:
        super().__init__()
        self.field = field
        self._weights = stage.weights
        self._cloud_points = config.data.cloud_points
        self._precision = precision

    def forward(self, batch: Batch, generator: torch.Generator) -> tuple[Tensor, dict[str, Tensor]]:
        """The sum () with gradient, and every loss () before weighting, without."""
        device = batch.points.device.type
        with torch.autocast(device, self._precision, self._precision != torch.float32):
            context = LossContext(self.field, batch, generator, self._cloud_points)
            terms = {name: LOSSES[name](context) for name in self._weights}
        total = torch.stack([w * terms[name].float() for name, w in self._weights.items()]).sum()
        return total, {
            "total": total.detach(),
            **{name: value.detach().float() for name, value in terms.items()},
        }


def stage_steps(stage: Stage, dataset: ShapeDataset, world: int) -> int:
    """How many steps a stage has."""
    if stage.steps is not None:
        return stage.steps
    assert stage.epochs is not None
    return max(1, round(stage.epochs * dataset.steps_per_epoch(stage.batch_size, world)))


def learning_rate(stage: Stage, step: int, length: int) -> float:
    """The rate at a step of a stage."""
    rate = stage.rate * min(1.0, (step + 1) / (stage.warmup + 1))
    if stage.schedule == "cosine":
        rate *= 0.5 * (1 + math.cos(math.pi * step / length))
    return rate


def check_parts(config: TrainConfig, field: Field) -> None:
    """ConfigError for a field without weights, or where a part is named which it lacks."""
    if not any(True for _ in field.parameters()):
        raise ConfigError(f"the preset '{config.preset}' has no weights: nothing to train")
    for stage in config.stages:
        for name in [] if stage.parts == "all" else stage.parts:
            if name not in field.parts():
                raise ConfigError(
                    f"stage '{stage.name}': {unknown_name('part', name, list(field.parts()))}"
                )
    for name in config.optimizer.muon:
        if name not in field.parts():
            raise ConfigError(f"optimizer.muon: {unknown_name('part', name, list(field.parts()))}")


def select_parts(field: Field, stage: Stage) -> list[nn.Parameter]:
    """Freeze the parts that the stage does not train; the parameters of the others."""
    field.train()
    for name, part in field.parts().items():
        trains = stage.parts == "all" or name in stage.parts
        part.requires_grad_(trains).train(trains)
    return [parameter for parameter in field.parameters() if parameter.requires_grad]


@contextmanager
def deferred_interrupt(enabled: bool) -> Iterator[threading.Event]:
    """An event that the first Ctrl-C (or SIGTERM) sets, so that a run can stop between two steps
    with a checkpoint; a second one interrupts at once."""
    event = threading.Event()
    if not enabled or threading.current_thread() is not threading.main_thread():
        yield event
        return

    def stop(number: int, frame: Any) -> None:
        if event.is_set():
            raise KeyboardInterrupt
        event.set()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield event
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def not_finite(stage: Stage, step: int, terms: dict[str, Tensor]) -> str:
    """Which step had no finite gradient, and which losses were to blame."""
    blamed = [name for name, value in terms.items() if not math.isfinite(float(value))]
    return (
        f"step {step} (stage '{stage.name}') had no finite gradient and changed nothing; "
        f"not finite: {', '.join(blamed) or 'none of the losses, only a derivative'}"
    )
