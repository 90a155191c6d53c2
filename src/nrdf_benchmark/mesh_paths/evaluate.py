"""Plan on every region of real meshes with one planner, and measure; goes on where it was cut."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from nrdf.errors import DataError, NrdfError, unknown_name
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.planners import PLANNERS
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.types import Segment
from nrdf.viz.picture import Panel, draw_regions
from nrdf_benchmark.mesh_paths.found_surface import SurfaceKind, regions_on
from nrdf_benchmark.mesh_paths.measure import MeshPathMetrics, measure_mesh_path
from nrdf_benchmark.mesh_paths.targets import MeshTarget, TargetSource
from nrdf_benchmark.result_cache import LineCache, code_checksum

AUTO = "auto"
"""The planner that an engineer would take for a region of that name, see `usual_planner`."""
_RODS = ("leg", "rail", "arm", "armrest")
SOURCES = (
    "nrdf/geometry", "nrdf/surface", "nrdf/toolpath", "nrdf_benchmark/mesh_paths",
    "nrdf_benchmark/objects/dataset.py",
)  # fmt: skip
"""Code that results depend on."""


@dataclass(frozen=True)
class MeshPathResult:
    """One planner on one region. seconds: CPU time; metrics: None where there is no path, for the
    reason in `error`."""

    planner: str
    target: str
    region: str
    seconds: float
    metrics: MeshPathMetrics | None
    error: str = ""


RegionPlanner = Callable[[str], tuple[tuple[Segment, ...], RegionMesh | None]]
"""From a region's name to its path, and the mesh that it was planned on."""
PICTURE_PX = 700


def usual_planner(region: str) -> str:
    """Rod for legs, rails and armrests, raster for all else: seats, backs, tops, bonnets."""
    return "rod" if region in _RODS else "raster"


def evaluate_mesh_paths(
    sources: Sequence[TargetSource],
    planner: str = AUTO,
    cache: LineCache | None = None,
    progress: Callable[[int, int], None] | None = None,
    surface: SurfaceKind = "mesh",
    pictures: Path | None = None,
) -> list[MeshPathResult]:
    """Plan and measure on every region; meshes that `cache` has are not planned on again.

    planner: a name in `nrdf.toolpath.planners.PLANNERS`, or `AUTO`. surface: what it plans on.
    pictures: a folder that is there, for a picture of each mesh that is planned on. `progress` is
    told (done, all). Raises DataError for a planner that there is not, or a mesh that cannot be
    used.
    """
    if planner not in (AUTO, *PLANNERS):
        raise DataError(unknown_name("planner", planner, [AUTO, *PLANNERS]))
    marks = {_fingerprint(source, planner, surface): source.name for source in sources}
    file = f"toolpaths-{planner}-{surface}.jsonl"
    lines = cache.read(file, marks) if cache else {}
    results = []
    for number, (mark, source) in enumerate(zip(marks, sources, strict=True)):
        found = _parse(lines.get(source.name))
        if found is None:
            found = _evaluate(source.read(), planner, surface, pictures)
            if cache:
                cache.append(file, mark, {"results": [asdict(result) for result in found]})
        results += found
        if progress is not None:
            progress(number + 1, len(sources))
    return results


def _evaluate(
    target: MeshTarget, planner: str, surface: SurfaceKind, pictures: Path | None
) -> list[MeshPathResult]:
    strategy = target.strategy
    start = time.process_time()
    make = _on_mesh(target, planner, strategy, surface)
    shared = (time.process_time() - start) / max(len(target.visible_regions), 1)
    results = []
    drawn: dict[str, tuple[RegionMesh, tuple[Segment, ...]]] = {}
    for region in target.visible_regions:
        name = usual_planner(region) if planner == AUTO else planner
        segments: tuple[Segment, ...] = ()
        metrics, error, found = None, "", None
        start = time.process_time()
        try:
            segments, found = make(region)
        except NrdfError as failed:
            error = str(failed)
        seconds = shared + time.process_time() - start
        if any(segment.kind == "process" for segment in segments):
            judged = None if surface == "mesh" else found
            metrics = measure_mesh_path(target, region, segments, strategy, judged)
        elif not error:
            error = "the planner made no process segment"
        results.append(MeshPathResult(name, target.name, region, seconds, metrics, error))
        if found is not None:
            drawn[region] = (found, segments)
    if pictures is not None and drawn:
        _draw(target, drawn, pictures / f"{target.name.replace('/', '-')}.png")
    return results


def _draw(
    target: MeshTarget, drawn: Mapping[str, tuple[RegionMesh, tuple[Segment, ...]]], path: Path
) -> None:
    """The strokes on their regions, and the ways between them, on the mesh that was planned on."""
    off = target.strategy.standoff_m
    lines, moves = {}, []
    for region, (_, segments) in drawn.items():
        strokes = [s for s in segments if s.kind == "process"]
        lines[region] = [s.positions + off * s.axes for s in strokes]
        moves += [s.positions for s in segments if s.kind != "process"]
    whole = next(iter(drawn.values()))[0].parent
    regions = {region: found.mesh for region, (found, _) in drawn.items()}
    panel = Panel.of_mesh(target.name, whole, regions, lines, moves)
    draw_regions([panel], path, PICTURE_PX, details=True)


def _on_mesh(
    target: MeshTarget, planner: str, strategy: Strategy, surface: SurfaceKind
) -> RegionPlanner:
    find = regions_on(target, surface)

    def make(region: str) -> tuple[tuple[Segment, ...], RegionMesh | None]:
        found = find(region)
        name = usual_planner(region) if planner == AUTO else planner
        return plan_on_mesh(found, strategy, PLANNERS[name]), found

    return make


def _fingerprint(source: TargetSource, planner: str, surface: SurfaceKind) -> str:
    parts = [source.name, source.checksum, planner, surface, code_checksum(SOURCES)]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]


def _parse(line: dict[str, Any] | None) -> list[MeshPathResult] | None:
    """A line's results; None for one that is not ours."""
    try:
        return [
            MeshPathResult(
                **{
                    **one,
                    "metrics": one["metrics"] and MeshPathMetrics(**one["metrics"]),
                }
            )
            for one in line["results"]  # type: ignore[index]
        ]
    except (TypeError, KeyError):
        return None
