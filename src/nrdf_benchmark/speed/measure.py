"""All presets, one after the other, each measurement in a process of its own.

So the peak memory of a measurement is its own.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch

from nrdf.errors import NrdfError
from nrdf_benchmark.speed.common import in_new_process
from nrdf_benchmark.speed.retrieval import (
    RetrievalSpeed,
    choose_weights,
    command_seconds,
    measure_retrieval,
)
from nrdf_benchmark.speed.training import TrainingSpeed, measure_training

BARS = {"warm_s": 0.5, "peak_memory_bytes": 1.5e9, "command_s": 8.0}
"""What preset default must keep to on 2 cores: warm retrieval of 8 regions, its process's peak
memory, and `nrdf retrieve` from a cold shell."""


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
    progress: Callable[[str], None] = lambda what: None,
) -> tuple[list[RetrievalSpeed], list[TrainingSpeed], list[Failure]]:
    """Retrieval and training speed of each preset; `steps` 0 leaves training out.

    `progress` is told what is measured next. What a preset cannot do is a `Failure`, and no
    exception.
    """
    retrieval: list[RetrievalSpeed] = []
    training: list[TrainingSpeed] = []
    failures: list[Failure] = []
    for preset in presets:
        with tempfile.TemporaryDirectory() as folder:
            try:
                progress(f"{preset}: retrieval")
                weights, model = choose_weights(preset, Path(folder))
                speed = in_new_process(measure_retrieval, preset, model, weights, device, repeats)
                progress(f"{preset}: nrdf retrieve from a cold shell")
                command_s = command_seconds(weights, device, Path(folder))
                retrieval.append(replace(speed, command_s=command_s))
            except NrdfError as error:
                failures.append(Failure(preset, "retrieval", str(error)))
        if steps:
            try:
                progress(f"{preset}: training steps")
                training += in_new_process(measure_training, preset, device, steps)
            except NrdfError as error:
                failures.append(Failure(preset, "training", str(error)))
    return retrieval, training, failures


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
