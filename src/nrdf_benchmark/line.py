"""The line under load: objects a minute, memory, and what `kill -9` leaves.

Objects are meshes of `nrdf_benchmark.objects`, stretched at random within 8 % along each axis, so
that no two are the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nrdf.cell.file import read_cell
from nrdf.serve.line import open_line
from nrdf.serve.outbox import OBJECT
from nrdf_benchmark.objects.dataset import read_objects

_STRETCH = 0.08
_POLL_S = 0.05
_SETTLED_SHARE = 0.1
"""Of the objects, after which memory is compared: models are loaded by then."""


@dataclass(frozen=True)
class LineSpeed:
    """What a line did with all objects of an inbox. resident_mb: of its workers, as each object
    ended; cpu_s: processor time of each object."""

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


def write_inbox(folder: Path, data: Path, categories: list[str], count: int, seed: int) -> None:
    """Write `count` stretched meshes into a new folder."""
    import trimesh

    rng = np.random.default_rng(seed)
    objects = read_objects(data, categories)
    folder.mkdir(parents=True)
    for number in range(count):
        of = objects[number % len(objects)]
        stretch = rng.uniform(1.0 - _STRETCH, 1.0 + _STRETCH, 3)
        mesh = trimesh.Trimesh(of.vertices * stretch, of.faces, process=False)
        name = f"{of.entry.category}-{of.entry.name}-{number:04}.ply"
        mesh.export(folder / name)


def measure_line(cell_file: Path, inbox: Path, out: Path, workers: int) -> LineSpeed:
    """Let a line take everything in an inbox."""
    cell = read_cell(cell_file)
    resident: list[float] = []
    with open_line(cell, cell_file, out, inbox, workers) as line:
        line.on_end = lambda row: resident.append(line.pool.resident_mb())
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


def kill_runs(cell_file: Path, inbox: Path, out: Path, kills: int, seed: int) -> dict[str, int]:
    """Kill `nrdf run` at random moments, at most `kills` times, then let it end; what was found.

    lost: objects without an outcome; twice: with more than one folder; halves: folders without
    their object.json, or unlike the store.
    """
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    words = ["run", str(cell_file), str(inbox), "--out", str(out), "--once"]
    rng, done = np.random.default_rng(seed), 0
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    for _ in range(kills):
        process = subprocess.Popen([sys.executable, "-c", code, *words], **quiet)  # type: ignore[call-overload]
        try:
            process.wait(float(rng.uniform(2.0, 20.0)))
            break
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            done += 1
    subprocess.run([sys.executable, "-c", code, *words], check=False, **quiet)  # type: ignore[call-overload]
    return {"kills": done, **check_outbox(inbox, out)}


def check_outbox(inbox: Path, out: Path) -> dict[str, int]:
    """How many objects of an inbox are lost, done twice, or half written in an outbox."""
    folders = [p for outcome in ("done", "look-at", "refused") for p in (out / outcome).iterdir()]
    sources, halves = Counter(), 0  # type: ignore[var-annotated]
    for folder in folders:
        try:
            said = json.loads((folder / OBJECT).read_text("utf-8"))
        except (OSError, ValueError):
            halves += 1
            continue
        halves += said["outcome"] != folder.parent.name
        sources[Path(said["source"]).name] += 1
    names = [path.name for path in inbox.iterdir()]
    return {
        "objects": len(names),
        "lost": sum(name not in sources for name in names),
        "twice": sum(count - 1 for count in sources.values()),
        "halves": halves,
    }
