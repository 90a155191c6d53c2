"""A transfer as a folder: the knowledge for the new object, its tool paths, report and pictures."""

from __future__ import annotations

import time
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.io.atomic import write_json
from nrdf.io.cloud import write_cloud
from nrdf.io.output import output_folder
from nrdf.io.result_folder import REPORT
from nrdf.process.bound_knowledge import checksum, overlaps
from nrdf.process.knowledge import Knowledge, Reference, Region
from nrdf.process.knowledge_file import write_knowledge
from nrdf.process.limits import Limits
from nrdf.process.strategy import strategy_of
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.transfer_result import TransferResult
from nrdf.regions.files import write_matches
from nrdf.reports.html import write_transfer_html
from nrdf.reports.job_meshes import write_job_meshes
from nrdf.reports.result_report import result_heat_maps
from nrdf.reports.transfer_report import transfer_report
from nrdf.toolpath.file import write_toolpaths
from nrdf.toolpath.tool_segments import contact_points
from nrdf.toolpath.types import Job
from nrdf.viz.picture import Panel, draw_regions, render_details

KNOWLEDGE, TARGET, REGIONS = "knowledge.yaml", "target.ply", "regions"
HTML_REPORT, PICTURE = "report.html", "picture.png"
_WHOLE, _DETAIL = 540, 280  # pixels of a view; the HTML report shows details smaller


def write_job(
    path: str | Path, result: TransferResult, title: str = "target", overwrite: bool = False
) -> None:
    """Write a transfer's result as the folder that `nrdf transfer` writes.

    The folder appears whole or not at all.

    Args:
        path: the folder.
        result: what `ProcessTransfer.transfer` gave.
        title: name of the target in the report.
        overwrite: replace what an earlier result wrote there.

    Raises:
        OutputError: the folder is not empty, without `overwrite`, or cannot be written.
    """
    with output_folder(path, overwrite) as folder:
        write_job_files(folder, result, Limits(), title, {})


def write_job_files(
    folder: Path,
    result: TransferResult,
    limits: Limits,
    title: str,
    origin: Mapping[str, Any],
) -> dict[str, Any]:
    """Write a transfer into an existing folder; what its report.json says.

    knowledge.yaml, target.ply (in metres, in the target's own frame), regions/ (their points),
    surface.ply and region_meshes/ (`nrdf.reports.job_meshes`), toolpaths.json (for `nrdf export`),
    report.json, report.html and picture.png. `title` names the target,
    `origin` (command, model, versions, ...) is added to the report. Without any tool path there is
    neither knowledge.yaml nor toolpaths.json. Raises OutputError if something cannot be written.
    """
    target = result.target
    write_cloud(folder / TARGET, target)
    (folder / REGIONS).mkdir()
    found = {n: r.match for n, r in result.regions.items() if not r.missing}
    write_matches(folder / REGIONS, target, found)
    if result.surface is not None:
        meshes = {n: r.mesh for n, r in result.regions.items() if r.mesh is not None}
        write_job_meshes(folder, result.surface, meshes, target.frame)
    job = job_of(result)
    if job.paths:
        write_toolpaths(folder, job)
        write_knowledge(folder / KNOWLEDGE, _knowledge(result, folder, origin))
    start = time.perf_counter()
    panel = panel_of(result, title)
    assert panel.scene is not None  # made ready before two threads ask for it
    with ThreadPoolExecutor(2) as pool:
        whole = pool.submit(draw_regions, [panel], folder / PICTURE, _WHOLE)
        details = pool.submit(render_details, panel, panel.names, _DETAIL).result()
        whole.result()
    seconds = {**result.seconds, "pictures": time.perf_counter() - start}
    report = {"title": title, **transfer_report(result, limits), **origin}
    report["seconds"] = {name: round(value, 3) for name, value in seconds.items()}
    report["date"] = datetime.now(timezone.utc).isoformat(timespec="seconds")
    heat_maps = result_heat_maps(result)
    write_transfer_html(folder / HTML_REPORT, report, folder / PICTURE, details, heat_maps)
    files = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    report["files"] = [*files, REPORT]
    write_json(folder / REPORT, report)
    return report


def job_of(result: TransferResult) -> Job:
    """The job of a transfer: its tool paths in the order of execution."""
    return Job(
        category=result.bound_knowledge.knowledge.category,
        frame=result.target.frame or "target",
        paths=tuple(step.path for step in result.paths if step.path is not None),
        pose=result.pose,
    )


def panel_of_reference(process_transfer: ProcessTransfer, title: str) -> Panel:
    """The reference with its regions, and what each process does there, for a picture."""
    lines: dict[str, list[np.ndarray]] = {}
    for region, number, _ in process_transfer.steps():
        lines.setdefault(region, []).extend(process_transfer.reference_contacts(region, number))
    paths = process_transfer.reference_paths
    regions = {name: region.mesh for name, region in paths.regions.found.items()}
    note = f"{len(regions)} regions, each with a process of its own"
    if len(regions) == 1:
        note = f"taught: {next(iter(regions))}"
    return Panel.of_mesh(title, paths.surface.mesh, regions, lines, note=note)


def panel_of(result: TransferResult, title: str, note: str = "") -> Panel:
    """The target's mesh, upright, with its regions' and the lines of its tool paths, for a picture;
    the target's points where it has no mesh."""
    turn = np.eye(3) if result.pose is None else result.pose.rotation
    lines = {n: [line @ turn for line in drawn] for n, drawn in lines_of_paths(result).items()}
    if result.surface is not None:
        found = {n: r.mesh.mesh for n, r in result.regions.items() if r.mesh is not None}
        regions = {name: Mesh(mesh.vertices @ turn, mesh.faces) for name, mesh in found.items()}
        surface = Mesh(result.surface.vertices @ turn, result.surface.faces)
        return Panel.of_mesh(title, surface, regions, lines, note=note)
    points = {n: r.match.indices for n, r in result.regions.items() if not r.missing}
    target = result.target
    normals = None if target.normals is None else target.normals @ turn
    return Panel(title, target.points @ turn, normals, points, note, lines)


def lines_of_paths(result: TransferResult) -> dict[str, list[np.ndarray]]:
    """The lines of tool paths on the surface by region, each (m, 3), m, in the target's frame."""
    lines: dict[str, list[np.ndarray]] = {}
    for step in result.paths:
        if step.path is not None:
            work = [s for s in step.path.segments if s.kind == "process"]
            strategy = strategy_of(step.process)
            drawn = lines.setdefault(step.region, [])
            drawn.extend(contact_points(segment, strategy) for segment in work)
    return lines


def _knowledge(result: TransferResult, folder: Path, origin: Mapping[str, Any]) -> Knowledge:
    """The knowledge for the target: its regions, and its processes as they were transferred."""
    knowledge = result.bound_knowledge.knowledge
    regions = []
    for region in knowledge.regions:
        # In the file's order, whatever their order of execution.
        done = [
            step.process
            for number in range(len(region.processes))
            for step in result.paths
            if (step.region, step.number) == (region.name, number) and step.path is not None
        ]
        if done:
            file = f"{REGIONS}/{region.name}.ply"
            regions.append(Region(name=region.name, file=file, processes=done))
    found = {n: r.match.indices for n, r in result.regions.items() if not r.missing}
    frame = result.target.frame
    reference = Reference(cloud=TARGET, sha256=checksum(folder / TARGET), frame=frame)
    keys = ("command", "knowledge", "target", "model", "date")
    return Knowledge(
        category=knowledge.category,
        model=knowledge.model,
        reference=reference,
        allow_unusual=knowledge.allow_unusual,
        allow_overlap=knowledge.allow_overlap or bool(overlaps(found)),
        regions=regions,
        origin={key: origin[key] for key in keys if key in origin},
    )
