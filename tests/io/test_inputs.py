"""Targets as users have them: every kind gives the same cloud, and everything else a CloudError."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import trimesh

import nrdf
from builders.small_model import build, chair
from nrdf.errors import CloudError
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.io.inputs import as_cloud

CHAIR, REGIONS = chair()
BOX = trimesh.creation.box((1.0, 0.4, 0.6))


class Vectors:
    """Like Open3D's Vector3dVector: a sequence that NumPy makes an array of."""

    def __init__(self, values):
        self.values = np.asarray(values, float).reshape(-1, 3)

    def __len__(self):
        return len(self.values)

    def __getitem__(self, index):
        return self.values[index]

    def __array__(self, dtype=None, copy=None):
        return np.array(self.values, dtype)


def open3d_cloud(points, normals=()):
    return SimpleNamespace(points=Vectors(points), normals=Vectors(normals), colors=Vectors([]))


def test_a_cloud_is_taken_as_it_is():
    assert as_cloud(CHAIR) is CHAIR


@pytest.mark.parametrize(
    "given",
    [
        CHAIR.points,
        CHAIR.points.astype(np.float32).astype(np.float64),
        CHAIR.points.tolist(),
        torch.tensor(CHAIR.points),
        trimesh.PointCloud(CHAIR.points),
        open3d_cloud(CHAIR.points),
    ],
)
def test_points_of_any_kind_keep_their_order(given):
    cloud = as_cloud(given)
    np.testing.assert_allclose(cloud.points, CHAIR.points, atol=1e-6)
    assert cloud.points.dtype == np.float64 and cloud.normals is None


def test_paths_are_read(tmp_path):
    write_cloud(tmp_path / "a.ply", CHAIR)
    for path in (tmp_path / "a.ply", str(tmp_path / "a.ply")):
        np.testing.assert_array_equal(as_cloud(path).points, CHAIR.points)
    with pytest.raises(CloudError, match="cannot read"):
        as_cloud(tmp_path / "none.ply")


def test_normals_of_open3d_are_used(caplog):
    cloud = as_cloud(open3d_cloud(CHAIR.points, 2 * CHAIR.normals))
    np.testing.assert_allclose(cloud.normals, CHAIR.normals, atol=1e-12)
    cloud = as_cloud(open3d_cloud(CHAIR.points, 0 * CHAIR.normals))
    assert cloud.normals is None and "all are left out" in caplog.text
    with pytest.raises(CloudError, match="do not fit"):
        as_cloud(open3d_cloud(CHAIR.points, CHAIR.normals[:5]))


@pytest.mark.parametrize("kind", ["mesh", "scene", "open3d"])
def test_meshes_are_sampled_as_their_files_are(tmp_path, kind):
    BOX.export(tmp_path / "a.ply")
    from_file = read_cloud(tmp_path / "a.ply", mesh_samples=500)
    given = {
        "mesh": BOX,
        "scene": trimesh.Scene(BOX),
        "open3d": SimpleNamespace(vertices=Vectors(BOX.vertices), triangles=BOX.faces),
    }[kind]
    before = BOX.vertices.copy()
    cloud = as_cloud(given, mesh_samples=500)
    np.testing.assert_allclose(cloud.points, from_file.points, atol=1e-6)
    np.testing.assert_allclose(cloud.normals, from_file.normals, atol=1e-6)
    assert cloud.mesh is not None and len(cloud.mesh.faces) == 12
    np.testing.assert_array_equal(BOX.vertices, before)
    assert len(as_cloud(given, mesh_samples=0)) == 8


def test_the_unit_of_trimesh_is_kept():
    mesh = BOX.copy()
    for said, unit in (("mm", "mm"), ("meters", "m"), ("inches", "in"), ("furlongs", None)):
        mesh.units = said
        assert as_cloud(mesh, mesh_samples=300).unit == unit
    scene = trimesh.Scene(mesh)
    scene.units = "mm"
    assert as_cloud(scene, mesh_samples=300).unit == "mm"


BAD = {
    "nothing": (None, "NoneType of object; accepted are a path"),
    "a number": (3.5, "accepted are a path"),
    "a mapping": ({"points": CHAIR.points}, "accepted are a path"),
    "words": (["a", "b"], "accepted are a path"),
    "an object": (object(), "accepted are a path"),
    "bytes": (b"a.ply", "accepted are a path"),
    "booleans": (np.ones((4, 3), bool), "accepted are a path"),
    "ragged rows": ([[1, 2, 3], [4, 5]], "accepted are a path"),
    "two columns": (np.zeros((4, 2)), r"shape \(4, 2\), not \(n, 3\)"),
    "six columns": (np.zeros((4, 6)), r"PointCloud\(points, normals\)"),
    "one dimension": (np.zeros(3), r"shape \(3,\)"),
    "an empty array": (np.zeros((0, 3)), "holds no points"),
    "an empty list": ([], r"shape \(0,\)"),
    "an empty mesh": (trimesh.Trimesh(), "the mesh has no faces"),
    "a mesh without area": (
        SimpleNamespace(vertices=np.zeros((3, 3)), faces=[[0, 1, 2]]), "no surface",
    ),
    "a mesh with other faces": (
        SimpleNamespace(vertices=np.zeros((3, 3)), faces=[[0, 1, 9]]), "does not exist",
    ),
    "a mesh of words": (SimpleNamespace(vertices=["a"], faces=[["b"]]), "cannot be used"),
    "a huge mesh": (trimesh.Trimesh(BOX.vertices * 1e200, BOX.faces, process=False), "coordinates"),
    "an empty scene": (trimesh.Scene(), "no faces|put together"),
    "open3d without points": (open3d_cloud([]), "holds no points"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_everything_else_says_what_is_accepted(case):
    given, message = BAD[case]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(CloudError, match=message) as caught:
            as_cloud(given, "the target")
    assert "the target" in str(caught.value)


@pytest.fixture(scope="module")
def taught():
    return build().set_reference(CHAIR.points)


@pytest.mark.parametrize("kind", ["path", "array", "trimesh", "open3d", "embedded"])
def test_retrieve_takes_targets_of_every_kind(tmp_path, taught, kind):
    write_cloud(tmp_path / "new.ply", PointCloud(CHAIR.points))
    target = {
        "path": str(tmp_path / "new.ply"),
        "array": CHAIR.points,
        "trimesh": trimesh.PointCloud(CHAIR.points),
        "open3d": open3d_cloud(CHAIR.points),
        "embedded": taught.model.encode(tmp_path / "new.ply"),
    }[kind]
    expected = taught.retrieve(REGIONS["seat"], PointCloud(CHAIR.points))
    match = taught.retrieve(REGIONS["seat"], target)
    np.testing.assert_array_equal(match.indices, expected.indices)


def test_a_mesh_is_a_reference_and_a_target():
    taught = build().set_reference(BOX)
    region = nrdf.as_cloud(BOX).points[:1000]
    match = taught.retrieve(region, BOX)
    expected = taught.retrieve(region, nrdf.as_cloud(BOX))
    np.testing.assert_array_equal(match.indices, expected.indices)


def test_what_cannot_be_a_target_is_named(taught):
    for call, name in (
        (taught.model.encode, "the cloud"),
        (taught.model.set_reference, "the reference"),
        (lambda given: taught.retrieve(REGIONS["seat"], given), "the target"),
        (lambda given: taught.retrieve_all(REGIONS, given), "the target"),
        (lambda given: nrdf.align(taught.model, given), "the scan"),
        (lambda given: nrdf.align(taught.model, CHAIR, examples=[given]), "an example"),
    ):
        with pytest.raises(CloudError, match=f"{name}.*accepted are"):
            call({"x": 1})
    with pytest.raises(CloudError, match="NaN or infinite"):
        taught.retrieve(REGIONS["seat"], np.full((1000, 3), np.nan))
