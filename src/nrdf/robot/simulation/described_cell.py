"""The cell that a cell file describes, as the simulation takes it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.cell.placement import object_pose, require_limits, with_cell_tools
from nrdf.cell.work_cell import KeepOutBox, WorkCell
from nrdf.robot.model.arm import load_arm
from nrdf.robot.model.cell import Box, Placement
from nrdf.robot.model.signed_distance import SignedDistanceField
from nrdf.robot.simulation.job import SimulationJob
from nrdf.robot.simulation.simulate import SimulationResult, object_distance_field, simulate


def place_in_cell(
    cell: WorkCell, work: SimulationJob, distance_field: SignedDistanceField
) -> tuple[SimulationJob, Placement]:
    """The job with the cell's tools, standing as it does there, and the placement that says so.

    distance_field: of the object. The turntable stays as it is. Raises ProcessError where the cell
    has not the job's tools, or does not say where the object stands, and LimitError for a job that
    is faster or presses harder than the cell's robot may.
    """
    T_base_object = object_pose(cell, work.job, work.points)
    rotation = T_base_object[:3, :3]
    samples = distance_field.samples @ rotation.T + T_base_object[:3, 3]
    low, high = samples.min(axis=0), samples.max(axis=0)
    middle, floor = 0.5 * (low + high), cell.robot.floor_m
    placement = Placement(
        base_m=(-float(middle[0]), -float(middle[1]), -floor),
        base_yaw_rad=0.0,
        stand_m=float(low[2]) - floor,
        turntable_rad=(0.0,),
        keep_out=keep_out_boxes(cell.keep_out),
        loads={
            tool.name: (tool.mass_kg, tool.centre_of_mass_m or (0.0, 0.0, 0.0))
            for tool in cell.tools
            if tool.mass_kg is not None
        },
    )
    require_limits(cell.robot, (), work.job)
    job = with_cell_tools(cell, work.job)
    origin = f"the object stands as the cell '{cell.name}' says"
    return replace(work, job=job, upright=rotation, origin=origin, assumed=False), placement


def simulate_in_cell(
    cell: WorkCell,
    folder: Path,
    work: SimulationJob,
    progress: Callable[[str], None] = lambda what: None,
) -> SimulationResult:
    """Simulate a job in the cell of a file in `folder`: its arm, tools, place, boxes and limits.

    Raises RobotError for an arm that cannot be used or reaches nothing, and as `place_in_cell`.
    """
    model = cell.robot.model
    arm = load_arm(folder / model if model else None, cell.robot.tool_frame)
    shape = object_distance_field(work)
    placed, placement = place_in_cell(cell, work, shape)
    return simulate(placed, arm, shape, placement, 1, progress=progress)


def keep_out_boxes(boxes: Sequence[KeepOutBox]) -> tuple[Box, ...]:
    """Keep-out boxes of a cell file as the simulation has them."""
    made = []
    for box in boxes:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(box.quaternion_xyzw).as_matrix()
        pose[:3, 3] = box.centre_m
        made.append(Box(box.name, pose, 0.5 * np.array(box.size_m)))
    return tuple(made)
