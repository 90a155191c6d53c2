"""Speed and memory of training steps, by stage."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from nrdf.field import build_field
from nrdf.shapes.dataset import Shape
from nrdf.shapes.families import get_family
from nrdf.shapes.synth import member_shape
from nrdf_benchmark.speed.common import CATEGORY, Stopwatch, device_memory, peak_memory

if TYPE_CHECKING:
    import torch

    from nrdf.training.config import Stage, TrainConfig
    from nrdf.training.dataset import ShapeDataset

MAX_STAGE_S = 60.0
"""Seconds after which no further training steps of a stage are measured."""


@dataclass(frozen=True)
class TrainingSpeed:
    """One stage's step: median seconds, and points (encoder's, queries and correspondences)
    processed a second."""

    preset: str
    stage: str
    device: str
    batch_size: int
    precision: str
    step_s: float
    points_per_s: float
    peak_memory_bytes: int
    device_memory_bytes: int | None


def measure_training(preset: str, device: str, steps: int) -> list[TrainingSpeed]:
    """The speed of each of a preset's stages: the median of `steps`, after one that warms up."""
    from nrdf.field.device import choose_device, choose_precision
    from nrdf.training.batch import seeded
    from nrdf.training.config import load_config
    from nrdf.training.loop import Objective, select_parts
    from nrdf.training.optimizer import make_optimizer

    config = load_config(preset)
    chosen = choose_device(device)
    precision = choose_precision(config.precision, chosen)
    field = build_field(config.preset, config.field).to(chosen)
    speeds = []
    for number, (stage, dataset) in enumerate(stage_datasets(config, chosen)):
        select_parts(field, stage)
        optimizer = make_optimizer(field, stage, config.optimizer)
        objective = Objective(field, stage, config, precision)
        clock = Stopwatch(device)
        seconds, points = [], 0
        for step in range(steps + 1):
            clock.lap()
            batch = dataset.batch(stage.batch_size, number, step)
            total, _ = objective(batch, seeded(chosen, number, step))
            optimizer.zero_grad(set_to_none=True)
            total.backward()
            optimizer.step()
            seconds.append(clock.lap())
            points = sum(t.shape[:2].numel() for t in (batch.points, batch.queries, batch.source))
            if sum(seconds) > MAX_STAGE_S:
                break
        # The first step warms up, unless it was the only one that there was time for.
        step_s = float(np.median(seconds[1:] or seconds))
        speeds.append(
            TrainingSpeed(
                preset=preset,
                stage=stage.name,
                device=str(chosen),
                batch_size=stage.batch_size,
                precision=str(precision).removeprefix("torch."),
                step_s=step_s,
                points_per_s=points / step_s,
                peak_memory_bytes=peak_memory(),
                device_memory_bytes=device_memory(device),
            )
        )
    return speeds


def stage_datasets(config: TrainConfig, device: torch.device) -> list[tuple[Stage, ShapeDataset]]:
    """Each stage, and shapes to train it on as it draws them, but from one pool."""
    from nrdf.training.dataset import ShapeDataset

    largest = max(stage.batch_size for stage in config.stages)
    data = config.data.model_copy(update={"pools": {}})
    dataset = ShapeDataset(training_shapes(largest), data, device)
    one_pool = [stage.model_copy(update={"pools": None}) for stage in config.stages]
    return [(stage, dataset.for_stage(stage)) for stage in one_pool]


def training_shapes(count: int) -> list[Shape]:
    """Training shapes: few, under many names, since what is in them does not change the cost."""
    surface = get_family(CATEGORY).member(1).sample_surface(4096, np.random.default_rng(0))
    made = [member_shape(CATEGORY, seed, surface.coordinates) for seed in range(2, 5)]
    return [replace(made[i % len(made)], name=f"shape-{i}") for i in range(count)]
