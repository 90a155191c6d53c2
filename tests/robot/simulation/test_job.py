from __future__ import annotations

import json
from dataclasses import replace
from shutil import copytree

import numpy as np
import pytest

from builders.arm_cells import path_of
from builders.plate_job import turned_job
from nrdf.errors import ProcessError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.robot.model.cell import Placement
from nrdf.robot.model.signed_distance import distance_field_from_points
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.toolpath.file import read_toolpaths, write_toolpaths
from nrdf.toolpath.types import Job


def test_a_folder_that_is_no_whole_job(tmp_path):
    write_toolpaths(tmp_path, Job("chair", "target", (path_of(),)))
    with pytest.raises(ProcessError, match=r"has no knowledge\.yaml"):
        read_simulation_job(tmp_path)


@pytest.mark.parametrize("up", ["z", "-x", "0.2 0.3 0.9"])
def test_a_job_stands_upright_in_the_cell_as_its_pose_says(plate_job, tmp_path, up):
    rotation = upright(up_axis(up)) @ rotation_about_up(0.4)
    pose = Similarity(rotation, np.array([2.0, -1.0, 5.0]), 1.0)
    job = read_simulation_job(turned_job(plate_job, tmp_path, pose))
    assert job.origin == "the object stands as the job's pose says" and not job.assumed
    distance_field = distance_field_from_points(job.points, job.normals)
    (there,) = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0,)).T_cell_object(
        distance_field, job.upright
    )
    np.testing.assert_allclose(there[:3, :3] @ rotation[:, 1], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(there[:3, :3] @ rotation[:, 0], [1, 0, 0], atol=1e-9)
    points = job.points @ there[:3, :3].T + there[:3, 3]
    assert points[:, 2].min() == pytest.approx(0.1, abs=0.01)
    assert np.ptp(points[:, 2]) == pytest.approx(0.03, abs=1e-6)  # the plate lies flat
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    np.testing.assert_allclose(middle[:2], 0.0, atol=0.01)


def test_a_job_that_does_not_say_how_it_lies_is_taken_to_be_canonical_and_said_to_be(plate_job):
    job = read_simulation_job(plate_job)
    np.testing.assert_allclose(job.upright[[2, 0]], np.eye(3)[[1, 0]], atol=1e-12)
    assert job.assumed and "taken to have +Y up and +X ahead" in job.origin
    given = read_simulation_job(plate_job, "z")
    np.testing.assert_allclose(given.upright[[2, 0]], np.eye(3)[[2, 0]], atol=1e-12)
    assert not given.assumed and given.origin == "up is z, as given"


def test_each_path_has_the_strategy_that_made_it(plate_job, tmp_path):
    for name in ("target.ply", "knowledge.yaml"):
        (tmp_path / name).write_bytes((plate_job / name).read_bytes())
    whole = read_toolpaths(plate_job)
    (path,) = whole.paths
    other = replace(path, process="sand 2", strategy=replace(path.strategy, edge_margin_m=0.05))
    write_toolpaths(tmp_path, replace(whole, paths=(other, path)))
    assert [s.edge_margin_m for s in read_simulation_job(tmp_path).strategies] == [0.05, 0.0]
    # A job of an earlier nrdf: nothing tells how it was planned.
    write_toolpaths(tmp_path, replace(whole, paths=(replace(path, strategy=None),)))
    with pytest.raises(
        ProcessError, match=r"'sand' on 'top' has no strategy in its toolpaths\.json"
    ):
        read_simulation_job(tmp_path)
    write_toolpaths(tmp_path, replace(whole, paths=(replace(path, region="side"),)))
    with pytest.raises(ProcessError, match=r"'sand' on 'side': its knowledge\.yaml has no such"):
        read_simulation_job(tmp_path)


def test_a_job_in_another_unit_and_in_another_frame(plate_job, tmp_path):
    folder = tmp_path / "job"
    copytree(plate_job, folder)
    content = json.loads((folder / "toolpaths.json").read_text())
    for segment in content["paths"][0]["segments"]:
        segment["positions_m"] = [[1000 * x for x in p] for p in segment["positions_m"]]
    (folder / "toolpaths.json").write_text(json.dumps(content))
    with pytest.raises(ProcessError, match="the two are in different units or frames"):
        read_simulation_job(folder)
    content["frame"] = "cell"
    (folder / "toolpaths.json").write_text(json.dumps(content))
    with pytest.raises(
        ProcessError, match="tool paths are in the frame 'cell', its object in 'target'"
    ):
        read_simulation_job(folder)
