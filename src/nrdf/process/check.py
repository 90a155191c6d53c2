"""Check knowledge: plan and measure every process on the reference, and know the category."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import readable
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.path_warnings import path_warnings
from nrdf.process.process import Process
from nrdf.process.reference_paths import ReferencePaths
from nrdf.process.result_target import plan_result, result_warnings
from nrdf.process.strategy import strategy_of
from nrdf.process.taught_paths import check_origin, normals_under, taught_segments
from nrdf.process_model.plan import PlannedResult
from nrdf.surface.given_surface import GivenSurface
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.metrics import ToolPathMetrics, measure_path
from nrdf.toolpath.tool_segments import add_approach_retract
from nrdf.toolpath.types import Segment


@dataclass(frozen=True)
class CheckedProcess:
    """A process planned on its region of the reference.

    fault: why it cannot be done, or "". warnings: what a person should look at. segments and
    metrics: of its tool path, none where it cannot be done. result: where one is wanted.
    """

    region: str
    process: Process
    fault: str = ""
    warnings: tuple[str, ...] = ()
    metrics: ToolPathMetrics | None = None
    segments: tuple[Segment, ...] = ()
    result: PlannedResult | None = None

    @property
    def where(self) -> str:
        """The region and the process, for a message."""
        return f"region '{self.region}', {self.process.label}"


def check_knowledge(
    bound_knowledge: BoundKnowledge, progress: Callable[[int, int], None] | None = None
) -> list[CheckedProcess]:
    """Plan and measure every process on the reference; `progress` is called with (done, all)."""
    reference = ReferencePaths(bound_knowledge)
    steps = [(region.name, p) for region in bound_knowledge.knowledge.regions for p in region.steps]
    checked = []
    for done, (name, process) in enumerate(steps, 1):
        try:
            region = reference.region(name)
        except ProcessError as error:
            checked.append(CheckedProcess(name, process, str(error)))
        else:
            checked.append(check_process(region, name, process, reference.given))
        if progress is not None:
            progress(done, len(steps))
    return checked


def check_process(
    region: RegionMesh, name: str, process: Process, given: GivenSurface | None = None
) -> CheckedProcess:
    """One process planned and measured on a region of the reference's mesh.

    given: the object as the user gave it, which the tool path is measured against.
    """
    warnings = []
    stepover, width = process.distance_between_lines_m, 2 * process.tool.radius_m
    if process.trajectory != "taught" and stepover > width:
        warnings.append(
            f"stepover_m is {stepover:g} ({readable('stepover_m', stepover)}), more than the "
            f"tool's width of {readable('width_m', width)}: stripes between the lines are left out"
        )
    if process.kind in ("sand", "polish") and process.force_n is None:
        warnings.append(f"{process.kind} without force_n: the robot holds a position, not a force")
    try:
        strategy = strategy_of(process)
        if process.waypoints is None:
            _check_spacing(region, process)
            check_origin(process, region.parent)
            segments = plan_on_mesh(region, strategy)
        else:
            taught = taught_segments(process, region.parent)
            normals = normals_under(region.parent, taught, strategy.tool_radius_m)
            segments = add_approach_retract(taught, normals, strategy)
        result = plan_result(region, process, segments, process.waypoints is None)
        if result is not None:
            segments, strategy = result.segments, result.strategy
        metrics = measure_path(region, strategy, segments, given)
    except ProcessError as error:
        return CheckedProcess(name, process, str(error), tuple(warnings))
    warnings += path_warnings(process, metrics) + result_warnings(process, result)
    return CheckedProcess(name, process, "", tuple(warnings), metrics, tuple(segments), result)


def _check_spacing(region: RegionMesh, process: Process) -> None:
    """Raise ProcessError for a spacing longer than the region, unless `allow_unusual` is set."""
    away = region.mesh.vertices - region.mesh.vertices.mean(axis=0)
    length = float(np.ptp(away @ np.linalg.eigh(away.T @ away)[1], axis=0).max())
    if process.spacing_m > length and not process.allow_unusual:
        spacing = f"{process.spacing_m:g} ({readable('spacing_m', process.spacing_m)})"
        raise ProcessError(
            f"spacing_m is {spacing}, longer than the region, {readable('length_m', length)}; give "
            "less, or set allow_unusual: true in the process"
        )
