"""Speed and memory of retrieval: by phase in one process, and `nrdf retrieve` from a cold shell."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nrdf
from nrdf.errors import NrdfError
from nrdf.field import build_field
from nrdf.field.weights import save_weights
from nrdf.field.zoo import find_weights, list_models
from nrdf.io.cloud import write_cloud
from nrdf_benchmark.speed.common import (
    CATEGORY,
    POINTS,
    Stopwatch,
    device_memory,
    eight_regions,
    example,
    peak_memory,
)


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


def measure_retrieval(
    preset: str, model: str, weights: Path, device: str, repeats: int
) -> RetrievalSpeed:
    """Seconds and memory in this process, from loading the weights on; without `command_s`."""
    clock = Stopwatch(device)
    loaded = nrdf.load_model(weights, device)
    load_s = clock.lap()
    reference = example(1)
    regions = eight_regions(reference)
    targets = [example(seed) for seed in range(2, 3 + repeats)]
    clock.lap()
    encoded_reference = loaded.set_reference(reference)
    reference_s = clock.lap()
    seconds, phases = [], []
    for target in targets:
        clock.lap()
        encoded = loaded.encode(target)
        encoded_reference.retrieve_all(regions, encoded)
        seconds.append(clock.lap())
        phases.append(encoded.seconds)
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
        peak_memory_bytes=peak_memory(),
        device_memory_bytes=device_memory(device),
    )


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


def choose_weights(preset: str, folder: Path) -> tuple[Path, str]:
    """A weight file of a preset: the zoo's, that of the examples' category where there is one, or
    untrained weights written into `folder`."""
    for entry in sorted(list_models(), key=lambda entry: entry.category != CATEGORY):
        if entry.preset == preset:
            return find_weights(entry.name), entry.name
    path = folder / "untrained.safetensors"
    save_weights(path, build_field(preset), {"category": CATEGORY})
    return path, "untrained"
