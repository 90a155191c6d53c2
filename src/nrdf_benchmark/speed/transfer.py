"""How long a transfer takes, everything included."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import nrdf
from nrdf.process.bound_knowledge import resolve
from nrdf.process.knowledge import Knowledge, Reference, Region
from nrdf.process.limits import Limits
from nrdf.process.process import Process
from nrdf.process.tool_keys import Tool
from nrdf.process.transfer import ProcessTransfer
from nrdf.reports.job_folder import write_job_files
from nrdf.shapes.families import get_family
from nrdf_benchmark.speed.common import CATEGORY, POINTS, example

REGIONS = 8
TRANSFER_BAR_S = 3.0
"""What a transfer of 8 regions must keep to on 2 cores, wall time."""
_RASTER = Process(
    kind="sand",
    stepover_m=0.025,
    tool=Tool(radius_m=0.025, clearance_m=0.02),
    force_n=20.0,
    feed_m_s=0.1,
)


@dataclass(frozen=True)
class TransferSpeed:
    """Median seconds of a transfer to a further target of 8192 points without normals.

    It finds regions, plans and measures a raster on each, and writes all files of a job folder.
    wall_s: on the clock; cpu_s: of the process, all threads; phases: wall time by phase.
    """

    regions: int
    points: int
    wall_s: float
    cpu_s: float
    phases: dict[str, float]


def raster_knowledge() -> Knowledge:
    """A raster on each of the eight largest named regions of a family's chair."""
    family, cloud = get_family(CATEGORY), example(1)
    surface = family.member(1).sample_surface(POINTS, np.random.default_rng(1))
    named = family.region_of(surface.coordinates)
    sizes = sorted(family.region_names, key=lambda name: -int((named == name).sum()))
    return Knowledge(
        category=CATEGORY,
        reference=Reference(points_m=cloud.points.tolist()),
        regions=[
            Region(name=n, indices=np.flatnonzero(named == n).tolist(), processes=[_RASTER])
            for n in sizes[:REGIONS]
        ],
    )


def measure_transfer(device: str = "cpu", repeats: int = 5) -> TransferSpeed:
    """Speed of a transfer with the category's model in the zoo, after one that warms up."""
    process_transfer = ProcessTransfer(
        resolve(raster_knowledge()), nrdf.load_model(CATEGORY, device)
    )
    walls, cpus, phases = [], [], []
    for seed in range(2, 3 + repeats):
        target = example(seed)
        wall, cpu = time.perf_counter(), time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            done = process_transfer.transfer(target)
            report = write_job_files(Path(folder), done, Limits(), "target", {})
        walls.append(time.perf_counter() - wall)
        cpus.append(time.process_time() - cpu)
        phases.append({**report["seconds"], "files": walls[-1] - sum(report["seconds"].values())})
    return TransferSpeed(
        regions=REGIONS,
        points=POINTS,
        wall_s=float(np.median(walls[1:])),
        cpu_s=float(np.median(cpus[1:])),
        phases={name: float(np.median([p[name] for p in phases[1:]])) for name in phases[0]},
    )
