from __future__ import annotations

from dataclasses import replace
from shutil import copytree

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import read_bound_knowledge
from nrdf.reports.job_meshes import write_job_meshes
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.job_surface import read_job_surfaces
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

RADII = {"top": 0.025}


def box() -> TargetMesh:
    made = trimesh.creation.box((0.3, 0.2, 0.1))
    return TargetMesh.from_mesh(Mesh(np.array(made.vertices), np.array(made.faces)))


def of_points(plate_job, noise: float):
    """Knowledge of a plate's folder, its cloud 20,000 points of the box with noise, m."""
    points, face = trimesh.sample.sample_surface(
        trimesh.creation.box((0.3, 0.2, 0.1)), 20_000, seed=0
    )
    normals = trimesh.creation.box((0.3, 0.2, 0.1)).face_normals[face]
    points = points + noise * np.random.default_rng(0).normal(size=points.shape)
    bound = read_bound_knowledge(plate_job / "knowledge.yaml")
    return replace(
        bound,
        cloud=PointCloud(points, normals, unit="m"),
        regions={"top": np.flatnonzero(normals[:, 1] > 0.9)},
    )


def write(folder, mesh: TargetMesh) -> None:
    region = RegionMesh.from_faces(mesh, mesh.face_normals[:, 1] > 0.9)
    write_job_meshes(folder, mesh, {"top": region})


def test_a_mesh_that_was_given_is_what_is_simulated(plate_job, tmp_path):
    write(tmp_path, box())
    found = read_job_surfaces(tmp_path, of_points(plate_job, 0.0), RADII)
    assert found.exact and found.origin == "the mesh that was given"
    assert len(found.given.faces) == 12
    assert found.regions["top"].parent is found.given
    assert found.regions["top"].area_m2 == pytest.approx(0.3 * 0.1)


def test_a_scan_is_simulated_with_all_its_points_not_with_what_was_planned_on(plate_job, tmp_path):
    planned = box()
    planned = TargetMesh(
        planned.vertices + np.array([0.0, 0.004, 0.0]), planned.faces
    )  # planned wrong
    write(tmp_path, planned)
    found = read_job_surfaces(tmp_path, of_points(plate_job, 2e-4), RADII)
    assert not found.exact and "all 20000 points" in found.origin
    # The true top is at 100 mm, whatever the plan says.
    top = np.array([[0.02, 0.11, 0.01]])
    assert found.given.nearest(top).points[0, 1] == pytest.approx(0.1, abs=3e-4)
    assert found.planned.nearest(top).points[0, 1] == pytest.approx(0.104, abs=1e-5)


def test_a_folder_of_an_earlier_nrdf_has_its_meshes_made_of_its_points(plate_job, tmp_path):
    found = read_job_surfaces(tmp_path, of_points(plate_job, 1e-4), RADII)
    assert found.regions["top"].area_m2 == pytest.approx(0.3 * 0.1, rel=0.1)
    with pytest.raises(ProcessError, match=r"none can be made of its region 'top'.*Transfer it"):
        read_job_surfaces(tmp_path, of_points(plate_job, 1e-4), {"top": 0.5})


def test_a_region_without_a_mesh_is_named(plate_job, tmp_path):
    write(tmp_path, box())
    (tmp_path / "region_meshes" / "top.ply").unlink()
    with pytest.raises(ProcessError, match="no mesh of the region 'top'"):
        read_job_surfaces(tmp_path, of_points(plate_job, 0.0), RADII)


def test_another_mesh_may_be_given_for_the_simulation(plate_job, tmp_path):
    folder = tmp_path / "job"
    copytree(plate_job, folder)
    thick = trimesh.creation.box((0.3, 0.03, 0.3)).apply_translation((0.0, 0.405, 0.0))
    thick.export(tmp_path / "thick.ply")
    job = read_simulation_job(folder)
    assert not job.surfaces.exact
    other = job.with_mesh(tmp_path / "thick.ply")
    assert other.surfaces.exact and len(other.surfaces.given.faces) == 12
    assert other.surfaces.regions["top"].parent is other.surfaces.given
    assert other.surfaces.planned is job.surfaces.planned
