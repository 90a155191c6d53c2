"""How many objects a minute a line takes, and how its memory grows."""

from __future__ import annotations

import os
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.cell.file import read_cell
from nrdf.serve.line import open_line
from nrdf.serve.pool import resident_mb

_POLL_S = 0.05
_SETTLED_SHARE = 0.1
"""Of the objects, after which memory is compared: models are loaded by then."""


@dataclass(frozen=True)
class LineSpeed:
    """What a line did with all objects of an inbox.

    resident_mb: of the line and its workers, as each object ended; cpu_s: processor time of each
    object.
    """

    workers: int
    outcomes: dict[str, int]
    wall_s: float
    cpu_s: tuple[float, ...]
    resident_mb: tuple[float, ...]

    @property
    def per_minute(self) -> float:
        """Objects a minute, by the clock."""
        return 60.0 * len(self.cpu_s) / self.wall_s

    @property
    def per_core_minute(self) -> float:
        """Objects a minute of one core's time: of a machine that does nothing else."""
        return 60.0 / float(np.mean(self.cpu_s))

    @property
    def memory_growth(self) -> float:
        """By what share memory grew from the first tenth of the objects to the last."""
        tenth = max(int(_SETTLED_SHARE * len(self.resident_mb)), 1)
        before = float(np.median(self.resident_mb[tenth : 2 * tenth]))
        return float(np.median(self.resident_mb[-tenth:])) / before - 1.0


def measure_line(cell_file: Path, inbox: Path, out: Path, workers: int) -> LineSpeed:
    """Let a line take everything in an inbox."""
    cell = read_cell(cell_file)
    resident: list[float] = []
    with open_line(cell, cell_file, out, inbox, workers) as line:
        own = os.getpid()
        line.on_end = lambda row: resident.append(
            line.pool.resident_mb() + (resident_mb(own) or 0.0)
        )
        while not line.pool.free:  # workers load their models before the clock starts
            line.pool.answers()
            time.sleep(_POLL_S)
        began, passes = time.monotonic(), 0
        while passes < 2 or not line.idle:
            line.step()
            passes += 1
            time.sleep(_POLL_S)
        rows = line.store.rows()
        outcomes = dict(Counter(row.state for row in rows))
        cpu = tuple(row.figures.get("cpu_s", 0.0) for row in rows)
        return LineSpeed(workers, outcomes, time.monotonic() - began, cpu, tuple(resident))
