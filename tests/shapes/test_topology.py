"""Meshes that share their triangulation correspond, vertex by vertex."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from nrdf.shapes.dataset import Shape, read_shape, write_shape
from nrdf.shapes.topology import POINTS, add_shared_topology

EGG = np.array([1.0, 0.5, 0.5])


@pytest.fixture
def folders(tmp_path):
    """Meshes of a ball, an egg of the same triangles and a box, all inside out; and the prepared
    shapes of all three."""
    meshes, shapes = tmp_path / "meshes", tmp_path / "shapes"
    meshes.mkdir()
    shapes.mkdir()
    made = {"ball": trimesh.creation.icosphere(3, 0.5), "egg": trimesh.creation.icosphere(3, 0.5)}
    made["egg"].apply_scale(EGG)
    made["box"] = trimesh.creation.box((1, 1, 1))
    for name, mesh in made.items():
        points, face = trimesh.sample.sample_surface(mesh, 20_000, seed=0)
        shape = Shape(
            name, "thing", "test", points.astype("f4"), mesh.face_normals[face].astype("f4"),
            np.zeros((8, 3), "f2"), np.zeros(8, bool),
        )  # fmt: skip
        write_shape(shapes / f"{name}.npz", shape, "stamp")
        trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False).export(
            meshes / f"{name}.ply"
        )
    return meshes, shapes


def test_index_i_is_the_same_place_of_all_meshes_of_the_same_triangles(folders):
    meshes, shapes = folders
    assert add_shared_topology(meshes.iterdir(), shapes) == {"shared-00": ["ball", "egg"]}
    groups = [read_shape(shapes / f"{n}.npz").correspondences["shared-00"] for n in ("ball", "egg")]
    assert groups[0].points.shape == (POINTS, 3)
    np.testing.assert_allclose(EGG * groups[0].points, groups[1].points, atol=1e-5)
    for group in groups:  # normals point outwards, though the meshes are inside out
        assert (group.points * group.normals).sum(axis=1).min() > 0.0
        assert group.weight.mean() > 0.95
    assert read_shape(shapes / "box.npz").correspondences == {}


def test_meshes_without_a_prepared_shape_are_passed_over(folders):
    meshes, shapes = folders
    (shapes / "egg.npz").unlink()
    assert add_shared_topology(meshes.iterdir(), shapes) == {"shared-00": ["ball", "egg"]}
    assert sorted(p.name for p in shapes.iterdir()) == ["ball.npz", "box.npz"]
