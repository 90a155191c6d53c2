"""What the measurements share: example clouds, a stopwatch, peak memory, a process of one's own."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import torch

from nrdf.io.cloud import PointCloud
from nrdf.shapes.families import get_family

CATEGORY = "chair"
POINTS = 8192


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


def in_new_process(function: Callable[..., Any], *arguments: Any) -> Any:
    """The function's result, from a new process."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(function, *arguments).result()


class Stopwatch:
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


def peak_memory() -> int:
    """Largest resident size of this process so far, in bytes."""
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def device_memory(device: str) -> int | None:
    """Largest memory allocated on the CUDA device so far, in bytes; None on a CPU."""
    if device == "cpu" or not torch.cuda.is_available():
        return None
    return torch.cuda.max_memory_allocated()
