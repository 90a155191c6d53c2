"""How fast and how large: retrieval by phase, training steps, a cold command line.

Every measurement runs in a process of its own, so that its peak memory is its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import torch

import nrdf
from nrdf.errors import NrdfError
from nrdf.field import build_field
from nrdf.field.weights import save_weights
from nrdf.field.zoo import list_models
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.shapes.dataset import Shape
from nrdf.shapes.families import get_family
from nrdf.shapes.synth import member_shape

CATEGORY = "chair"
POINTS = 8192
BARS = {"warm_s": 0.5, "peak_memory_bytes": 1.5e9, "command_s": 8.0}
"""What preset default must keep to on 2 cores: warm retrieval of 8 regions, its process's peak
memory, and `nrdf retrieve` from a cold shell."""


PATIENCE = 60.0
"""Seconds after which no further training steps of a stage are measured."""


@dataclass(frozen=True)
class RetrievalSpeed:
    """Seconds that 8 regions take on a target of 8192 points without normals.

    model: zoo name, or "untrained" (weights do not change the cost). load_s: reading the weights;
    reference_s: `set_reference`; cold_s: the first target; warm_s: the median of further targets,
    and warm_phases its parts; command_s: `nrdf retrieve` as a new process, files and picture
    included. peak_memory_bytes: of the measuring process; device_memory_bytes: of the CUDA device.
    """

    preset: str
    model: str
    device: str
    regions: int
    points: int
    load_s: float
    reference_s: float
    cold_s: float
    warm_s: float
    warm_phases: dict[str, float]
    command_s: float | None
    peak_memory_bytes: int
    device_memory_bytes: int | None


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


@dataclass(frozen=True)
class Failure:
    """What could not be measured, and why."""

    preset: str
    what: str
    reason: str


def measure(
    presets: tuple[str, ...],
    device: str = "cpu",
    repeats: int = 7,
    steps: int = 3,
    told: Callable[[str], None] = lambda what: None,
) -> tuple[list[RetrievalSpeed], list[TrainingSpeed], list[Failure]]:
    """Retrieval and training speed of each preset; `steps` 0 leaves training out.

    `told` hears what is measured next. What a preset cannot do is a `Failure`, not an exception.
    """
    retrieval: list[RetrievalSpeed] = []
    training: list[TrainingSpeed] = []
    failures: list[Failure] = []
    for preset in presets:
        with tempfile.TemporaryDirectory() as folder:
            try:
                told(f"{preset}: retrieval")
                weights, model = _weights(preset, Path(folder))
                speed = _alone(_retrieval_speed, preset, model, weights, device, repeats)
                told(f"{preset}: nrdf retrieve from a cold shell")
                command_s = command_seconds(weights, device, Path(folder))
                retrieval.append(replace(speed, command_s=command_s))
            except NrdfError as error:
                failures.append(Failure(preset, "retrieval", str(error)))
        if steps:
            try:
                told(f"{preset}: training steps")
                training += _alone(_training_speed, preset, device, steps)
            except NrdfError as error:
                failures.append(Failure(preset, "training", str(error)))
    return retrieval, training, failures


def example(seed: int, points: int = POINTS) -> PointCloud:
    """A chair of the parametric family, in metres, without normals."""
    rng = np.random.default_rng(seed)
    surface = get_family(CATEGORY).member(seed).sample_surface(points, rng)
    return PointCloud(surface.points * 0.9 + [0.0, 0.45, 0.0], unit="m")


def eight_regions(cloud: PointCloud) -> dict[str, np.ndarray]:
    """The cloud's octants, as masks (n,): eight regions that any cloud has."""
    above = cloud.points > np.median(cloud.points, axis=0)
    octant = above @ np.array([1, 2, 4])
    return {f"octant-{i}": octant == i for i in range(8) if (octant == i).any()}


def to_json(
    retrieval: list[RetrievalSpeed], training: list[TrainingSpeed], failures: list[Failure]
) -> dict[str, Any]:
    """Everything as plain values, with the bars that preset default must keep to."""
    return {
        "bars": BARS,
        "threads": torch.get_num_threads(),
        "cores": os.cpu_count(),
        "load_average": os.getloadavg() if hasattr(os, "getloadavg") else None,
        "retrieval": [asdict(speed) for speed in retrieval],
        "training": [asdict(speed) for speed in training],
        "failures": [asdict(failure) for failure in failures],
    }


def command_seconds(weights: Path, device: str, folder: Path) -> float:
    """Wall time of `nrdf retrieve` with 8 regions in a new process."""
    reference, target = example(1), example(2)
    write_cloud(folder / "reference.ply", reference)
    write_cloud(folder / "target.ply", target)
    regions = eight_regions(reference)
    np.savez(folder / "regions.npz", **regions)  # type: ignore[arg-type]
    command = [sys.executable, "-m", "nrdf.cli", "retrieve", "--model", str(weights)]
    command += ["--reference", str(folder / "reference.ply"), "--device", device]
    command += ["--region", str(folder / "regions.npz"), "--target", str(folder / "target.ply")]
    command += ["--out", str(folder / "result")]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True)
    seconds = time.perf_counter() - start
    if done.returncode:
        raise NrdfError(f"nrdf retrieve failed: {done.stderr.strip()}")
    return seconds


def _weights(preset: str, folder: Path) -> tuple[Path, str]:
    """A weight file of a preset: the zoo's, that of the examples' category where there is one, or
    untrained weights written into `folder`."""
    from nrdf.field.zoo import find_weights

    for entry in sorted(list_models(), key=lambda entry: entry.category != CATEGORY):
        if entry.preset == preset:
            return find_weights(entry.name), entry.name
    path = folder / "untrained.safetensors"
    save_weights(path, build_field(preset), {"category": CATEGORY})
    return path, "untrained"


def _alone(function: Callable[..., Any], *arguments: Any) -> Any:
    """The function's result, from a new process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


def _retrieval_speed(
    preset: str, model: str, weights: Path, device: str, repeats: int
) -> RetrievalSpeed:
    clock = _Stopwatch(device)
    loaded = nrdf.load_model(weights, device)
    load_s = clock.lap()
    reference = example(1)
    regions = eight_regions(reference)
    targets = [example(seed) for seed in range(2, 3 + repeats)]
    clock.lap()
    taught = loaded.set_reference(reference)
    reference_s = clock.lap()
    seconds, phases = [], []
    for target in targets:
        clock.lap()
        embedded = loaded.encode(target)
        taught.retrieve_all(regions, embedded)
        seconds.append(clock.lap())
        phases.append(embedded.seconds)
    return RetrievalSpeed(
        preset=preset,
        model=model,
        device=str(loaded.device),
        regions=len(regions),
        points=POINTS,
        load_s=load_s,
        reference_s=reference_s,
        cold_s=seconds[0],
        warm_s=float(np.median(seconds[1:])),
        warm_phases={name: float(np.median([p[name] for p in phases[1:]])) for name in phases[0]},
        command_s=None,
        peak_memory_bytes=_peak_memory(),
        device_memory_bytes=_device_memory(device),
    )


def _training_speed(preset: str, device: str, steps: int) -> list[TrainingSpeed]:
    from nrdf.field.device import choose_device, choose_precision
    from nrdf.training.batch import seeded
    from nrdf.training.config import load_config
    from nrdf.training.dataset import ShapeDataset
    from nrdf.training.loop import Objective, make_optimizer, select_parts

    config = load_config(preset)
    chosen = choose_device(device)
    largest = max(stage.batch_size for stage in config.stages)
    dataset = ShapeDataset(_shapes(largest), config.data.model_copy(update={"pools": {}}), chosen)
    precision = choose_precision(config.precision, chosen)
    field = build_field(config.preset, config.field).to(chosen)
    speeds = []
    for number, stage in enumerate(config.stages):
        parameters = select_parts(field, stage)
        optimizer = make_optimizer(parameters, stage, config.optimizer)
        objective = Objective(field, stage, config, precision)
        clock = _Stopwatch(device)
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
            if sum(seconds) > PATIENCE:
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
                peak_memory_bytes=_peak_memory(),
                device_memory_bytes=_device_memory(device),
            )
        )
    return speeds


def _shapes(count: int) -> list[Shape]:
    """Training shapes: few, under many names, since what is in them does not change the cost."""
    surface = get_family(CATEGORY).member(1).sample_surface(4096, np.random.default_rng(0))
    made = [member_shape(CATEGORY, seed, surface.coordinates) for seed in range(2, 5)]
    return [replace(made[i % len(made)], name=f"shape-{i}") for i in range(count)]


class _Stopwatch:
    """Wall time between laps, once the device has finished what it was given."""

    def __init__(self, device: str) -> None:
        self._cuda = device != "cpu" and torch.cuda.is_available()
        self._last = time.perf_counter()

    def lap(self) -> float:
        if self._cuda:
            torch.cuda.synchronize()
        now = time.perf_counter()
        passed, self._last = now - self._last, now
        return passed


def _peak_memory() -> int:
    """Largest resident size of this process so far, in bytes."""
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def _device_memory(device: str) -> int | None:
    if device == "cpu" or not torch.cuda.is_available():
        return None
    return torch.cuda.max_memory_allocated()
