"""Jobs in the robot's base frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.cells import BASE, cell_of
from builders.export_jobs import small_job
from nrdf.cell.placement import (
    broken_limits,
    job_in_base,
    object_pose,
    place_job,
    with_cell_tools,
)
from nrdf.errors import LimitError, ProcessError


def test_waypoints_are_where_the_pose_puts_them():
    job = small_job()
    pose = np.array(BASE["object"]["T_base_object"], float)
    placed = job_in_base(cell_of(), job, object_pose(cell_of(), job, None))
    assert placed.frame == "base"
    for before, after in zip(job.paths, placed.paths, strict=True):
        for one, two in zip(before.segments, after.segments, strict=True):
            # x of the base is -y of the job's frame, and y is its x.
            x, y, z = one.positions.T
            assert np.allclose(two.positions, np.stack([0.8 - y, x - 0.1, z + 0.3], axis=1))
            assert np.allclose(two.axes, one.axes @ pose[:3, :3].T)
    assert placed.paths[0].tcp_m == (0.0, 0.0, 0.18)
    assert np.allclose(placed.up, pose[:3, :3] @ job.up)


def test_an_object_on_a_fixture_stands_upright_and_faces_where_it_is_told():
    job = small_job()
    cell = cell_of(object={"fixture_m": [1.0, 0.2, 0.5], "facing_deg": 90})
    points = np.random.default_rng(0).uniform(-0.2, 0.3, (200, 3))
    pose = object_pose(cell, job, points)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert np.allclose(pose[:3, :3] @ job.up, [0, 0, 1])
    assert np.allclose(pose[:3, :3] @ job.forward, [0, 1, 0])
    placed = points @ pose[:3, :3].T + pose[:3, 3]
    assert placed[:, 2].min() == pytest.approx(0.5)
    assert np.allclose((placed.min(axis=0) + placed.max(axis=0))[:2] / 2, [1.0, 0.2])
    with pytest.raises(ProcessError, match="does not have its pose"):
        object_pose(cell, replace(job, pose=None), points)


def test_a_pose_that_people_rounded_is_a_rotation():
    turned = Rotation.from_euler("xyz", [10, 20, 30], degrees=True).as_matrix().round(4)
    rows = [[*row, 0.5] for row in turned.tolist()] + [[0, 0, 0, 1]]
    pose = object_pose(cell_of(object={"T_base_object": rows}), small_job(), None)
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)


def test_a_tool_that_the_cell_has_not_is_named():
    with pytest.raises(ProcessError, match=r"no tool 'camera'; it has: disc 125"):
        with_cell_tools(cell_of(tools=[BASE["tools"][0]]), small_job())


def test_what_is_too_fast_too_hard_or_kept_out_is_told(tmp_path):
    # The plate's middle is about (0.73, 0.03, 0.7) in the base; no waypoint lies in the thin box.
    box = {"name": "post", "centre_m": [0.74, 0.031, 0.7], "size_m": [0.2, 0.002, 0.2]}
    robot = {"max_feed_mm_s": 200, "max_force_n": 10}
    cell = cell_of(robot=robot, keep_out=[box])
    with pytest.raises(LimitError) as error:
        place_job(cell, small_job(), tmp_path)
    said = str(error.value)
    assert "the feed is 250.0 mm/s, above the cell's 200.0 mm/s" in said
    assert "the force is 15.0 N, above the cell's 10.0 N" in said
    assert "enters the keep-out box 'post'" in said
    placed = place_job(cell_of(), small_job(), tmp_path)
    assert broken_limits(cell_of().robot, (), placed) == []
