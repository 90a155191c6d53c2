"""The film or depth that a simulated arm really left, beside what its tool path would leave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.process.process import Process
from nrdf.process.result_target import ResultSettings, result_settings
from nrdf.process_model.cells import Cells
from nrdf.process_model.executed import ExecutedMotion, executed_values, measure_executed
from nrdf.process_model.moves import ToolSamples
from nrdf.process_model.result import ResultMetrics
from nrdf.process_model.result_model import ResultModel, cells_for
from nrdf.robot.model.cell import Cell
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.simulation.execute import ExecutionLog
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.types import ToolPath

_EACH = 3  # steps of the simulation that a sample stands for
_TOUCHES = 0.05  # share of the commanded force, below which the sensor's is its noise


@dataclass(frozen=True)
class ExecutedResult:
    """What a tool path left on its region of the true mesh.

    values_m: (n,) of the cells, film or depth as the settings ask for; metrics: of that. planned:
    metrics of the tool path driven as it is planned, on the same cells.
    """

    process: Process
    settings: ResultSettings
    cells: Cells
    values_m: np.ndarray
    metrics: ResultMetrics
    planned: ResultMetrics


def executed_result(
    process: Process,
    region: RegionMesh,
    path: ToolPath,
    cell: Cell,
    logs: Sequence[ExecutionLog],
    shift_m: np.ndarray,
) -> ExecutedResult | None:
    """Of an executed tool path; None for a process without a target.

    region: whose parent is the object's true mesh; shift_m: (3,) by which the object was shifted.
    """
    settings = result_settings(process)
    if settings is None:
        return None
    tool, target = settings.tool, settings.target
    cells = cells_for(region, tool)
    motion = executed_motion(cell, logs, shift_m)
    values = executed_values(cells, motion, tool, region.parent)
    return ExecutedResult(
        process, settings, cells, values,
        measure_executed(cells, values, motion, tool, target),
        ResultModel.of(region, path.segments, tool, cells).measure(target),
    )  # fmt: skip


def executed_motion(
    cell: Cell, logs: Sequence[ExecutionLog], shift_m: np.ndarray
) -> ExecutedMotion:
    """The tool's motion along its lines, in the object's own frame, waits and dwells included: a
    gun is on and a pad turns all that time, but where the gun is off in run-ups."""
    parts = [_part(cell, log) for log in logs if log.action.kind == "process" and len(log.tip)]
    if not parts:
        none, empty = np.zeros((0, 3)), np.zeros(0)
        return ExecutedMotion(ToolSamples(none, none, none, empty, np.zeros(0, int)), empty, empty)
    places, axes, along, weights, speeds, force = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    column = np.zeros(len(places), int)
    samples = ToolSamples(places - shift_m, axes, along, weights, column)
    return ExecutedMotion(samples, speeds, force)


def _part(cell: Cell, log: ExecutionLog) -> tuple[np.ndarray, ...]:
    """Places, axes, tool x, times, speeds and forces of every few steps of an action."""
    first = np.arange(0, len(log.tip), _EACH)
    count = np.diff(np.append(first, len(log.tip)))
    middle = first + count // 2
    steps = np.linalg.norm(np.diff(log.tip, axis=0, prepend=log.tip[:1]), axis=1)
    speeds = np.add.reduceat(steps, first) / (count * STEP_S)
    force = np.add.reduceat(log.force_n, first) / count
    commanded = log.action.force_n or 0.0
    force = np.where(force > _TOUCHES * commanded, force, 0.0)
    pose = cell.T_base_object[log.action.turntable_index]
    along = cell.chain.frames(log.joints[middle]).tool[:, :, 0] @ pose[:3, :3]
    axes = log.axis[middle]
    along = unit_vectors(along - np.einsum("ka,ka->k", along, axes)[:, None] * axes)
    off = log.action.tool_off
    on = count
    if off is not None:  # where the arm dwells, its gun is as at the line's end
        rows = off[np.minimum(np.arange(len(log.tip)), len(off) - 1)]
        on = count - np.add.reduceat(rows.astype(int), first)
    return log.tip[middle], axes, along, on * STEP_S, speeds, force
