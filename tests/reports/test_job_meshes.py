"""Meshes of a job come back as they were written."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.io.cloud import read_cloud
from nrdf.reports.job_meshes import SURFACE, read_job_meshes, write_job_meshes
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh


def block():
    box = trimesh.creation.box((0.4, 0.2, 0.1)).apply_translation((1 / 3, 0.0, 0.0))
    mesh = TargetMesh(np.array(box.vertices), np.array(box.faces))
    sides = {"top": mesh.face_normals[:, 2] > 0.9, "left side.2": mesh.face_normals[:, 1] > 0.9}
    return mesh, {name: RegionMesh.from_faces(mesh, of) for name, of in sides.items()}


def test_surface_and_regions_come_back_exactly(tmp_path):
    mesh, regions = block()
    write_job_meshes(tmp_path, mesh, regions, "scanner")
    found = read_job_meshes(tmp_path)
    assert set(found.regions) == set(regions)
    for name, one, other in (
        ("surface", mesh, found.surface),
        *((name, region.mesh, found.regions[name].mesh) for name, region in regions.items()),
    ):
        corners = (np.sort(m.vertices[m.faces].reshape(-1, 9), axis=0) for m in (one, other))
        np.testing.assert_array_equal(*corners, err_msg=name)
        assert other.face_areas.sum() == pytest.approx(one.face_areas.sum())
    assert all(region.parent is found.surface for region in found.regions.values())


def test_other_programs_and_nrdf_itself_can_read_the_surface(tmp_path):
    mesh, regions = block()
    write_job_meshes(tmp_path, mesh, regions, "scanner")
    assert trimesh.load(tmp_path / SURFACE).volume == pytest.approx(0.008)
    cloud = read_cloud(tmp_path / SURFACE)
    assert (cloud.unit, cloud.frame) == ("m", "scanner") and cloud.mesh is not None


def test_a_folder_without_meshes_or_with_a_damaged_one_is_refused(tmp_path):
    with pytest.raises(ProcessError, match=r"has no surface\.ply.*transfer it again"):
        read_job_meshes(tmp_path)
    write_job_meshes(tmp_path, *block())
    whole = (tmp_path / SURFACE).read_bytes()
    (tmp_path / SURFACE).write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ProcessError, match=r"surface\.ply.*transfer the job again"):
        read_job_meshes(tmp_path)
