"""The cell that a cell file describes, as the simulation takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.cell.placement import object_pose, with_cell_tools
from nrdf.cell.work_cell import KeepOutBox, WorkCell
from nrdf.robot.model.cell import Box, Placement
from nrdf.robot.model.signed_distance import SignedDistanceField
from nrdf.robot.simulation.job import SimulationJob


def place_in_cell(
    cell: WorkCell, work: SimulationJob, distance_field: SignedDistanceField
) -> tuple[SimulationJob, Placement]:
    """The job with the cell's tools, standing as it does there, and the placement that says so.

    distance_field: of the object. The turntable stays as it is. Raises ProcessError where the cell
    has not the job's tools, or does not say where the object stands.
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
    )
    job = with_cell_tools(cell, work.job)
    origin = f"the object stands as the cell '{cell.name}' says"
    return replace(work, job=job, upright=rotation, origin=origin, assumed=False), placement


def keep_out_boxes(boxes: Sequence[KeepOutBox]) -> tuple[Box, ...]:
    """Keep-out boxes of a cell file as the simulation has them."""
    made = []
    for box in boxes:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(box.quaternion_xyzw).as_matrix()
        pose[:3, 3] = box.centre_m
        made.append(Box(box.name, pose, 0.5 * np.array(box.size_m)))
    return tuple(made)
