"""A job in its cell: in the robot's base frame, with the cell's tools, and within its limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.cell.work_cell import CellRobot, KeepOutBox, WorkCell
from nrdf.errors import LimitError, ProcessError
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import read_cloud
from nrdf.reports.job_folder import TARGET
from nrdf.toolpath.types import Job, Segment, ToolPath

_SAME = 1e-9


def object_pose(cell: WorkCell, job: Job, points: np.ndarray | None) -> np.ndarray:
    """T_base_object (4, 4): the pose of the job's frame in that of the robot's base.

    points: (n, 3) of the object in the job's frame, m, for objects on a fixture. Raises
    ProcessError where a fixture needs what the job does not say.
    """
    place = cell.object
    if place.T_base_object is not None:
        pose = np.array(place.T_base_object, float)
        pose[:3, :3] = _nearest_rotation(pose[:3, :3])
        return pose
    if job.pose is None or points is None:
        missing = "its pose" if job.pose is None else "the object's points (target.ply)"
        raise ProcessError(
            f"the cell stands objects on a fixture, but the job does not have {missing}: give "
            "object.T_base_object in the cell file, or transfer the job again"
        )
    # Canonical +Y is up and +X ahead; in the base's frame z is up.
    canonical = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    about_z = Rotation.from_euler("z", place.facing_rad).as_matrix()
    rotation = about_z @ canonical @ job.pose.rotation.T
    low, high = (points @ rotation.T).min(axis=0), (points @ rotation.T).max(axis=0)
    underside = np.array([*(0.5 * (low + high))[:2], low[2]])
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, np.array(place.fixture_m) - underside
    return pose


def object_points(job_folder: Path) -> np.ndarray | None:
    """The points (n, 3) of a job's object, m, in the job's frame; None where it has none."""
    file = job_folder / TARGET
    return read_cloud(file).points if file.is_file() else None


def job_in_base(cell: WorkCell, job: Job, T_base_object: np.ndarray) -> Job:
    """The job with positions in the frame of the robot's base, and with the cell's tools.

    Raises ProcessError for a tool that the cell does not have.
    """
    paths = [_placed(path, T_base_object) for path in with_cell_tools(cell, job).paths]
    pose = job.pose and job.pose.then(Similarity(T_base_object[:3, :3], T_base_object[:3, 3], 1.0))
    return replace(job, frame=cell.robot.base_frame, paths=tuple(paths), pose=pose)


def with_cell_tools(cell: WorkCell, job: Job) -> Job:
    """The job, its tools where the cell has them. Raises ProcessError for one that it has not."""
    tools = {tool.name: tool for tool in cell.tools}
    paths = []
    for path in job.paths:
        if path.tool not in tools:
            raise ProcessError(
                f"region '{path.region}', {path.process}: the cell has no tool '{path.tool}'; it "
                f"has: {', '.join(tools)}"
            )
        tool = tools[path.tool]
        turn = tool.tcp_quaternion_xyzw or (0.0, 0.0, 0.0, 1.0)
        paths.append(replace(path, tcp_m=tool.tcp_m, tcp_quaternion_xyzw=turn))
    return replace(job, paths=tuple(paths))


def place_job(cell: WorkCell, job: Job, folder: Path) -> Job:
    """The job of a folder in the robot's base frame, with the cell's tools and within its limits.

    Raises ProcessError where it cannot be placed, LimitError for limits that it does not meet.
    """
    placed = job_in_base(cell, job, object_pose(cell, job, object_points(folder)))
    require_limits(cell.robot, cell.keep_out, placed)
    return placed


def require_limits(robot: CellRobot, boxes: Sequence[KeepOutBox], placed: Job) -> None:
    """Raise LimitError for a job in the base's frame that does not meet a cell's limits."""
    if broken := broken_limits(robot, boxes, placed):
        raise LimitError(
            "\n  ".join(["not within the cell's limits; nothing is written:", *broken])
        )


def broken_limits(robot: CellRobot, boxes: Sequence[KeepOutBox], placed: Job) -> list[str]:
    """A line for each limit of the cell that a job in the base's frame does not meet: speed, force,
    and the tool centre point in a keep-out box."""
    lines = []
    for path in placed.paths:
        where = f"region '{path.region}', {path.process}"
        feed = max((float(s.speeds_m_s.max()) for s in path.segments), default=0.0)
        force = max((s.force_n or 0.0 for s in path.segments), default=0.0)
        if robot.max_feed_m_s is not None and feed > robot.max_feed_m_s + _SAME:
            lines.append(
                f"{where}: the feed is {1e3 * feed:.1f} mm/s, above the cell's "
                f"{1e3 * robot.max_feed_m_s:.1f} mm/s"
            )
        if robot.max_force_n is not None and force > robot.max_force_n + _SAME:
            lines.append(
                f"{where}: the force is {force:.1f} N, above the cell's {robot.max_force_n:.1f} N"
            )
        for box in boxes:
            inside = sum(_steps_inside(box, segment) for segment in path.segments)
            if inside:
                lines.append(f"{where}: its tool centre point enters the keep-out box '{box.name}'")
    return lines


def _steps_inside(box: KeepOutBox, segment: Segment) -> int:
    """How many of a segment's straight moves (or its single point) touch a box."""
    if len(segment.positions) == 0:
        return 0
    rotation = Rotation.from_quat(box.quaternion_xyzw).as_matrix()
    local = (segment.positions - box.centre_m) @ rotation
    half = 0.5 * np.array(box.size_m)
    start, end = (local[:-1], local[1:]) if len(local) > 1 else (local, local)
    # Slabs: where along the move, from 0 to 1, each axis is within the box.
    way = end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (-half - start) / way, (half - start) / way
    still, within = np.abs(way) < 1e-12, np.abs(start) <= half
    enter = np.where(still, np.where(within, -np.inf, np.inf), np.minimum(one, two)).max(axis=1)
    leave = np.where(still, np.where(within, np.inf, -np.inf), np.maximum(one, two)).min(axis=1)
    return int(((enter <= leave) & (enter <= 1.0) & (leave >= 0.0)).sum())


def _placed(path: ToolPath, pose: np.ndarray) -> ToolPath:
    turn = Rotation.from_matrix(pose[:3, :3])
    segments = tuple(
        replace(
            segment,
            positions=segment.positions @ pose[:3, :3].T + pose[:3, 3],
            quaternions_xyzw=(turn * Rotation.from_quat(segment.quaternions_xyzw)).as_quat()
            if len(segment.positions)
            else segment.quaternions_xyzw,
        )
        for segment in path.segments
    )
    return replace(path, segments=segments)


def _nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) nearest to one that was rounded as people write it."""
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v)
