"""Training steps of the paper's network beside those of a plain reading of it, on equal work."""

from __future__ import annotations

import time
from dataclasses import dataclass

import torch

from nrdf.errors import ConfigError
from nrdf.field import build_field
from nrdf.field.paper import PaperField
from nrdf.training.batch import seeded
from nrdf.training.config import load_config
from nrdf.training.loop import Objective, select_parts
from nrdf.training.optimizer import make_optimizer
from nrdf_benchmark.speed.plain_paper import PlainPaper
from nrdf_benchmark.speed.training import stage_datasets


@dataclass(frozen=True)
class StepComparison:
    """One stage's step on the same batches: shapes, points that each is encoded from, queries, and
    points that are reconstructed; seconds of wall time and of CPU time, ours and the plain
    reading's, the least of several."""

    preset: str
    stage: str
    threads: int
    shapes: int
    points: int
    queries: int
    cloud_points: int
    step_s: float
    cpu_s: float
    plain_step_s: float
    plain_cpu_s: float


def compare_steps(preset: str, threads: int, steps: int) -> list[StepComparison]:
    """Each stage of a configuration on the CPU, `steps` of both after one that warms up.

    Raises ConfigError for one of another network than the paper's.
    """
    torch.set_num_threads(threads)
    config = load_config(preset)
    if config.preset != PaperField.preset:
        raise ConfigError(
            f"there is a plain reading of the preset 'paper' alone; '{preset}' trains "
            f"'{config.preset}': give paper-short or paper"
        )
    field = build_field(config.preset, config.field)
    assert isinstance(field, PaperField)
    plain = PlainPaper(field, config.data.cloud_points)
    found = []
    for number, (stage, dataset) in enumerate(stage_datasets(config, torch.device("cpu"))):
        select_parts(field, stage)
        optimizer = make_optimizer(field, stage, config.optimizer)
        ours = Objective(field, stage, config, torch.bfloat16)
        least = []
        for is_plain in (False, True):
            wall, cpu = [], []
            for step in range(steps + 1):
                generator = seeded(torch.device("cpu"), number, step)
                batch = dataset.batch(stage.batch_size, number, step)
                begun, used = time.perf_counter(), time.process_time()
                if is_plain:
                    terms = plain.losses(batch, tuple(stage.weights), generator)
                    total = torch.stack([w * terms[n] for n, w in stage.weights.items()]).sum()
                else:
                    total = ours(batch, generator)[0]
                optimizer.zero_grad(set_to_none=True)
                total.backward()
                optimizer.step()
                wall.append(time.perf_counter() - begun)
                cpu.append(time.process_time() - used)
            least += [min(wall[1:] or wall), min(cpu[1:] or cpu)]
        shapes, points = batch.points.shape[:2]
        sizes = (shapes, points, batch.queries.shape[1], plain.cloud_points)
        found.append(StepComparison(preset, stage.name, threads, *sizes, *least))
    return found
