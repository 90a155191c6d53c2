"""How long many objects take on many workers, and what breaks first: simulated from measured times.

What is measured: processor time of objects, and what Dask adds to a task. What is simulated: one
scheduler, whose single thread hands out every task, and workers that die and load their models
again.
"""

from __future__ import annotations

import heapq
import os
import resource
import tracemalloc
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.serve.many import TransferOutcome
from nrdf.serve.store import ObjectRow
from nrdf.serve.summary import csv_text
from nrdf.tasks import run_tasks

_TASKS, _FEW, _DRAWN = 2000, 100, 100_000
_START_S = 10.0
"""A worker's, until it has loaded its models."""
_DEATHS_A_DAY = 1.0
"""Of one worker: more than machines that are looked after have."""
_PATH = "/data/catalogue/chairs/chair-0123456.ply"


@dataclass(frozen=True)
class Overhead:
    """What Dask adds to a task, processor time, s. serial: in the process of the scheduler and the
    client; whole: of all processes."""

    serial_s: float
    whole_s: float


@dataclass(frozen=True)
class ScaleOut:
    """A simulated run. scheduler_busy: share of its time; worker_busy: mean of all."""

    hours: float
    scheduler_busy: float
    worker_busy: float
    deaths: int


def measure_overhead() -> Overhead:
    """By tasks that do nothing, on two local workers; what starting them takes is left out."""
    few, many = (_processor_time(count) for count in (_FEW, _FEW + _TASKS))
    return Overhead((many[0] - few[0]) / _TASKS, (sum(many) - sum(few)) / _TASKS)


def _processor_time(count: int) -> tuple[float, float]:
    """Of this process, and of those that it starts, s."""
    before = _used()
    for _ in run_tasks(abs, range(count), 2):
        pass
    after = _used()
    return after[0] - before[0], after[1] - before[1]


def _used() -> tuple[float, float]:
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    own, children = (resource.getrusage(kind) for kind in kinds)
    return own.ru_utime + own.ru_stime, children.ru_utime + children.ru_stime


def simulate(
    seconds: Sequence[float], serial_s: float, objects: int, workers: int, seed: int = 0
) -> ScaleOut:
    """So many objects, whose times are drawn from the measured ones, on so many workers.

    A task whose worker dies is begun again by another, and the dead one starts anew.
    """
    rng = np.random.default_rng(seed)
    times = rng.choice(np.asarray(seconds, float), objects)
    dies = rng.random(objects) < times * _DEATHS_A_DAY / 86400.0
    shares = rng.random(objects)
    free = [(_START_S, number) for number in range(workers)]
    heapq.heapify(free)
    scheduler, worked, end = 0.0, 0.0, 0.0
    for number in range(objects):
        begins, worker = heapq.heappop(free)
        scheduler = max(scheduler, begins) + serial_s
        ends = scheduler + times[number]
        if dies[number]:
            ends += times[number] * shares[number] + _START_S
        worked += times[number]
        end = max(end, ends)
        heapq.heappush(free, (ends, worker))
    busy = objects * serial_s / end
    return ScaleOut(end / 3600.0, busy, worked / (workers * end), int(dies.sum()))


def limits(job_folders: Sequence[Path], objects: int) -> list[tuple[str, str, str]]:
    """What so many objects need, as (what, how much, what is done about it).

    job_folders: some that were made, which say how large one is.
    """
    files = [[p for p in folder.rglob("*") if p.is_file()] for folder in job_folders]
    count = sum(map(len, files)) / len(files)
    size = sum(p.stat().st_size for inner in files for p in inner) / len(files)
    row = ObjectRow(1, "chair-0123456", _PATH, 1, 1, "chair.ply", "done", figures={"paths": 1})
    line = len(csv_text([row]).splitlines()[1]) + 1
    longest = os.sysconf("SC_ARG_MAX") // (len(_PATH) + 9)
    return [
        ("the command line", f"{longest:,} names fit", "--targets-from"),
        ("files", f"{count * objects:,.0f} ({count:.0f} a job)", "check the file system's inodes"),
        ("disk", f"{size * objects / 1e12:.2f} TB ({size / 1e6:.2f} MB a job)", "--out on it"),
        ("memory of the command", f"{_outcome_bytes() * objects / 1e9:.1f} GB", "several commands"),
        ("objects.csv", f"{line * objects / 1e6:.0f} MB", "Parquet; the page shows 2,000"),
    ]


def _outcome_bytes() -> float:
    """Memory that one object takes in the process that hands them out."""
    count = 2000
    tracemalloc.start()
    kept: list[object] = []
    for number in range(count):
        total = {"paths": number, "skipped": 0, "cycle_time_s": float(number), "length_m": 1.5}
        target, folder = Path(f"{_PATH}{number}"), Path(f"/jobs/chair-{number:07}")
        kept += [target, folder, TransferOutcome(target, folder, 0, (), total)]
    used = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return used / count


def draw_scale_out(path: Path, seconds: Sequence[float], serial_s: float, objects: int) -> None:
    """Hours that so many objects take, by the number of workers, beside what they would if nothing
    but they took time."""
    from matplotlib.figure import Figure

    counts = [2**n for n in range(3, 13)]
    few = min(objects, _DRAWN)
    hours = [simulate(seconds, serial_s, few, n).hours * objects / few for n in counts]
    ideal = [float(np.mean(seconds)) * objects / n / 3600.0 for n in counts]
    figure = Figure((6.0, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.loglog(counts, ideal, "--", color="0.6", label="workers alone")
    axes.loglog(counts, hours, "o-", color="#1f6f8b", label="simulated")
    axes.axvline(float(np.mean(seconds)) / serial_s, color="#c0504d", lw=1)
    axes.set(xlabel="workers", ylabel=f"hours for {objects:,} objects")
    axes.text(
        0.98, 0.95, "red: as many as one scheduler feeds", transform=axes.transAxes, ha="right",
        va="top", color="#c0504d", fontsize=8,
    )  # fmt: skip
    axes.legend(loc="lower left", frameon=False)
    figure.savefig(path, dpi=150)
