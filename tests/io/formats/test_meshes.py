"""Meshes and lone vertices as clouds."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.cloud_files import POINTS, check_refused
from nrdf.errors import CloudError
from nrdf.io.cloud import read_cloud


def test_glb_is_a_mesh_or_points_in_metres(tmp_path):
    trimesh.creation.box((1.0, 0.4, 0.6)).export(tmp_path / "mesh.glb")
    cloud = read_cloud(tmp_path / "mesh.glb", mesh_samples=500)
    assert len(cloud) == 500 and cloud.unit == "m" and cloud.normals is not None
    trimesh.Scene(trimesh.PointCloud(POINTS)).export(tmp_path / "points.glb")
    np.testing.assert_allclose(read_cloud(tmp_path / "points.glb").points, POINTS, rtol=1e-6)
    content = (tmp_path / "mesh.glb").read_bytes()
    (tmp_path / "mesh.glb").write_bytes(content[:100])
    with pytest.raises(CloudError, match="truncated or damaged"):
        read_cloud(tmp_path / "mesh.glb")


@pytest.mark.parametrize("name", ["a.ply", "a.off", "a.obj", "a.stl"])
def test_a_mesh_is_sampled_on_its_visible_surface(tmp_path, name):
    both = trimesh.util.concatenate(
        [trimesh.creation.box((1.0, 0.4, 0.6)), trimesh.creation.box((0.5, 0.2, 0.3))]
    )
    both.export(tmp_path / name)
    cloud = read_cloud(tmp_path / name, mesh_samples=2000)
    assert len(cloud) == 2000
    on_skin = np.isclose(np.abs(cloud.points), [0.5, 0.2, 0.3], atol=1e-6).any(axis=1)
    assert on_skin.mean() > 0.99
    assert ((cloud.normals * cloud.points)[on_skin].sum(axis=1) > 0).all()
    again = read_cloud(tmp_path / name, mesh_samples=2000)
    np.testing.assert_array_equal(again.points, cloud.points)


@pytest.mark.parametrize("name", ["a.ply", "a.off", "a.obj"])
def test_the_vertices_of_a_mesh_can_be_asked_for(tmp_path, name):
    trimesh.creation.box((1.0, 0.4, 0.6)).export(tmp_path / name)
    assert len(read_cloud(tmp_path / name, mesh_samples=0)) == 8


BAD = {
    "truncated off": ("a.off", b"OFF\n4 0 0\n1 2 3\n", "truncated"),
    "huge off": ("a.off", b"OFF\n400000000 0 0\n1 2 3\n", "more than the file"),
    "no off": ("a.off", b"hello\n4 0 0\n1 2 3\n", "begin with OFF"),
    "bad obj": ("a.obj", b"v 1 2\n", "three coordinates"),
    "bad obj line": ("a.obj", b"v 1 2 x\n", "damaged"),
    "empty obj": ("a.obj", b"# nothing\n", "no points"),
    "bad stl": ("a.stl", b"solid\n", "unreadable|no faces"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_with_its_name_and_the_reason(tmp_path, case):
    check_refused(tmp_path, *BAD[case])
