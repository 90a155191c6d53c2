"""From a file to robot programs: every step of a transfer between labelled objects, and its end.

A part of a reference is a region with one process on it, as `nrdf teach` writes it; the
target is a mesh file. Nothing is simulated.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

from nrdf.errors import NrdfError, ProcessError
from nrdf.export.registry import export_job
from nrdf.io.atomic import write_atomically
from nrdf.io.cloud import PointCloud, read_cloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.knowledge_file import KNOWLEDGE_FILE
from nrdf.process.new_knowledge import DEFAULTS
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.transfer_result import TransferResult
from nrdf.reports.job_folder import write_job
from nrdf.toolpath.file import read_toolpaths
from nrdf_benchmark.objects.retrieval import ObjectRetrieval, Settings, shared_retrieval

SIZE_M = 0.9
"""Longest side of the objects."""
PROCESS = "sand"
FORMATS = ("urscript", "rapid")
_TARGET, _JOB, _PROGRAMS = "target.ply", "job", "programs"


@dataclass(frozen=True)
class JobResult:
    """One pair. ended: no step failed, and there is a program with at least one tool path;
    complete: so did every part that the reference and the target have. reasons: what failed, and
    for each of those parts why it has no path. crashed: what failed was no `NrdfError`.
    seconds: by step; memory_bytes: largest resident size of the process meanwhile, None where the
    system does not tell."""

    reference: str
    target: str
    ended: bool
    complete: bool
    reasons: tuple[str, ...]
    crashed: bool
    paths: int
    seconds: dict[str, float]
    memory_bytes: int | None


def run_job(settings: Settings, reference: str, target: str) -> JobResult:
    """Write the target's file, transfer to it, write the job and two programs of it."""
    retrieval = shared_retrieval(settings)
    seconds: dict[str, float] = {}
    step, reasons, crashed, paths = "", [], False, 0

    @contextmanager
    def timed(name: str) -> Iterator[None]:
        nonlocal step
        step, start = name, time.perf_counter()
        yield
        seconds[name] = time.perf_counter() - start

    _forget_peak()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        try:
            with timed("reference"):
                process_transfer = _process_transfer(settings, reference)
            with timed("target file"):
                mesh = retrieval.mesh(target)
                scaled = trimesh.Trimesh(SIZE_M * mesh.vertices, mesh.faces, process=False)
                write_atomically(folder / _TARGET, [export_ply(scaled)])
                cloud = read_cloud(folder / _TARGET)
            with timed("transfer"):
                done = process_transfer.transfer(cloud, "m")
            reasons = _missing(done, retrieval, target)
            with timed("job folder"):
                write_job(folder / _JOB, done, target)
            with timed("programs"):
                if all(step.path is None for step in done.paths):
                    raise ProcessError(f"no tool path: {'; '.join(reasons) or 'nothing found'}")
                job = read_toolpaths(folder / _JOB)
                export_job(job, FORMATS, folder / _PROGRAMS)
                paths = len(job.paths)
        except Exception as error:
            crashed = not isinstance(error, NrdfError)
            text = f"{type(error).__name__}: {error}" if crashed else str(error)
            reasons.append(f"{step}: {text.replace(place, '')}")
            paths = 0
    return JobResult(
        reference, target, bool(paths), bool(paths) and not reasons, tuple(reasons), crashed,
        paths, seconds, _peak(),
    )  # fmt: skip


def describe_jobs(jobs: Sequence[JobResult]) -> list[str]:
    """Jobs in words: how many ended well, what failed, time and memory."""
    if not jobs:
        return []
    ended, complete = (sum(getattr(job, name) for job in jobs) for name in ("ended", "complete"))
    total = [sum(job.seconds.values()) for job in jobs]
    memory = [job.memory_bytes for job in jobs if job.memory_bytes is not None]
    summary = (
        f"from file to robot programs ({' and '.join(FORMATS)}): {ended} of {len(jobs)} pairs "
        f"ended well, {complete} with a tool path on every part that both have; "
        f"{np.median(total):.1f} s a pair (median; {max(total):.1f} at most)"
    )
    if memory:
        summary += f", {max(memory) / 1e9:.2f} GB at most"
    failed = [job for job in jobs if not job.ended]
    return [summary, *(f"{job.reference} to {job.target}: {job.reasons[-1]}" for job in failed)]


@lru_cache(maxsize=1)
def _process_transfer(settings: Settings, reference: str) -> ProcessTransfer:
    retrieval = shared_retrieval(settings)
    whole = retrieval.whole_cloud(reference).cloud
    cloud = PointCloud(SIZE_M * whole.points, whole.normals, unit="m")
    process = {"kind": PROCESS, **DEFAULTS[PROCESS]}  # type: ignore[index]
    regions = retrieval.regions(reference)
    rows = [
        {"name": name, "indices": indices.tolist(), "processes": [process]}
        for name, indices in regions.items()
    ]
    content = {
        "category": retrieval.model.category,
        "reference": {"cloud": "reference.ply", "unit": "m"},
        "regions": rows,
    }
    return ProcessTransfer(
        BoundKnowledge(KNOWLEDGE_FILE.validated(content, reference), cloud, regions),
        retrieval.model,
    )


def _missing(done: TransferResult, retrieval: ObjectRetrieval, target: str) -> list[str]:
    """Why parts that the target has got no tool path."""
    there = retrieval.truth(target).parts
    return [
        f"{step.region}: {step.reason}"
        for step in done.paths
        if step.path is None and step.region in there
    ]


def _forget_peak() -> None:
    """On Linux, let the largest resident size be that from now on."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def _peak() -> int | None:
    """Largest resident size of this process since `_forget_peak`, in bytes; None if not known."""
    try:
        status = Path("/proc/self/status").read_text()
        line = next(line for line in status.splitlines() if line.startswith("VmHWM:"))
        return 1024 * int(line.split()[1])
    except (OSError, StopIteration):
        return None
