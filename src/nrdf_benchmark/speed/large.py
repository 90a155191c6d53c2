"""How long a transfer to a fine mesh or a dense scan takes, everything included."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nrdf
from nrdf.bundled import bundled_mesh
from nrdf.errors import NrdfError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf.io.ply import write_ply_mesh
from nrdf.process.bound_knowledge import resolve
from nrdf.process.knowledge_file import write_knowledge
from nrdf.process.limits import Limits
from nrdf.process.transfer import ProcessTransfer
from nrdf.reports.job_folder import write_job_files
from nrdf.surface.fine_mesh import edges_of, split_edges
from nrdf_benchmark.speed.common import CATEGORY, peak_memory
from nrdf_benchmark.speed.transfer import raster_knowledge

KINDS = {"mesh": "a mesh of 100,000 faces", "scan": "a scan of 1 million points"}
BARS = {"wall_s": 4.0, "command_s": 8.0, "peak_memory_bytes": 2e9}
"""What each must keep to on 2 cores: warm, from a cold shell, and in memory."""
_POINTS, _NOISE_M = 1_000_000, 5e-4
_FACES = 90_000


@dataclass(frozen=True)
class LargeTransfer:
    """Median seconds of a transfer of 8 regions, their paths, report and pictures, warm, on the
    clock and of the processor; `nrdf transfer` of the file from a cold shell; peak memory, bytes.
    """

    kind: str
    size: int
    wall_s: float
    cpu_s: float
    command_s: float
    peak_memory_bytes: int


def write_large(kind: str, path: Path) -> int:
    """Write the bundled real chair as a fine mesh or a dense scan; its faces or points."""
    mesh = bundled_mesh()
    vertices, faces = mesh.vertices, mesh.faces
    if kind == "mesh":
        while len(faces) < _FACES:  # each into four
            pairs, of_face = edges_of(faces)
            vertices = np.concatenate([vertices, vertices[pairs].mean(axis=1)])
            faces, _ = split_edges(faces, len(vertices) - len(pairs) + of_face, vertices)
        write_ply_mesh(path, vertices, faces, ["unit m"])
        return len(faces)
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder) / "mesh.ply"
        write_ply_mesh(given, vertices, faces, ["unit m"])
        points = nrdf.read_cloud(given, _POINTS).points
    noise = np.random.default_rng(0).normal(0.0, _NOISE_M, points.shape)
    write_cloud(path, PointCloud(points + noise, unit="m"))
    return len(points)


def measure_large(kind: str, device: str = "cpu", repeats: int = 3) -> LargeTransfer:
    """Speed of a transfer to one of `KINDS` with the category's model, after one that warms up."""
    walls, cpus = [], []
    with tempfile.TemporaryDirectory() as folder:
        file, knowledge = Path(folder) / "target.ply", Path(folder) / "knowledge.yaml"
        size = write_large(kind, file)
        write_knowledge(knowledge, raster_knowledge())
        process = ProcessTransfer(resolve(raster_knowledge()), nrdf.load_model(CATEGORY, device))
        target = nrdf.read_cloud(file)
        for number in range(repeats + 1):
            wall, cpu = time.perf_counter(), time.process_time()
            done = process.transfer(target)
            (job := Path(folder) / f"job-{number}").mkdir()
            write_job_files(job, done, Limits(), "target", {})
            walls.append(time.perf_counter() - wall)
            cpus.append(time.process_time() - cpu)
        peak = peak_memory()
        command = [sys.executable, "-m", "nrdf.cli", "transfer", str(knowledge), str(file)]
        start = time.perf_counter()
        ran = subprocess.run(
            [*command, "--out", str(Path(folder) / "cold")], capture_output=True, text=True
        )
        command_s = time.perf_counter() - start
        if ran.returncode:
            raise NrdfError(f"nrdf transfer failed: {ran.stderr.strip()}")
    wall_s, cpu_s = float(np.median(walls[1:])), float(np.median(cpus[1:]))
    return LargeTransfer(kind, size, wall_s, cpu_s, command_s, peak)
