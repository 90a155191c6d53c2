"""The mesh that paths are planned on: of a mesh its outer skin, of a cloud the one through it."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.surface.mesh_edges import boundary_loops
from nrdf.surface.object_mesh import object_mesh

BALL = trimesh.creation.icosphere(4, radius=0.4)


def ball_cloud(mesh: Mesh | None = None, normals: bool = True) -> PointCloud:
    points, face = trimesh.sample.sample_surface(BALL, 4000, seed=0)
    return PointCloud(points, BALL.face_normals[face] if normals else None, "m", mesh=mesh)


def test_a_mesh_stays_the_mesh_that_it_is_without_its_inner_wall():
    both = trimesh.util.concatenate([BALL, trimesh.creation.icosphere(2, radius=0.3)])
    found = object_mesh(ball_cloud(Mesh(np.array(both.vertices), np.array(both.faces))), 0.03)
    assert len(found.faces) == len(BALL.faces)
    assert any("2 parts united" in repair for repair in found.repairs)


def test_a_cloud_becomes_a_mesh():
    found = object_mesh(ball_cloud(), 0.1)
    np.testing.assert_allclose(np.linalg.norm(found.vertices, axis=1), 0.4, atol=0.002)
    outward = np.einsum("fa,fa->f", found.face_normals, found.vertices[found.faces].mean(axis=1))
    assert (outward > 0.0).all()


@pytest.mark.parametrize(
    ("cloud", "radius", "message"),
    [
        (ball_cloud(normals=False), 0.03, "without normals; estimate them"),
        (ball_cloud(), 0.0, "radius must be above 0 m, not 0"),
        (ball_cloud(), np.nan, "radius must be above 0 m, not nan"),
        (
            ball_cloud(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))),
            0.03,
            "no paths can be planned",
        ),
    ],
)
def test_what_has_no_surface_is_refused(cloud, radius, message):
    with pytest.raises(ProcessError, match=message):
        object_mesh(cloud, radius)


def test_points_far_apart_become_a_closed_mesh_and_an_open_plate_stays_open():
    stick = trimesh.creation.box((0.4, 0.05, 0.05))
    points, face = trimesh.sample.sample_surface(stick, 800, seed=0)
    found = object_mesh(PointCloud(points, stick.face_normals[face], "m"), 0.01)
    assert boundary_loops(found.faces) == []
    rng = np.random.default_rng(0)
    plate = np.column_stack([rng.uniform(0, 0.4, 900), rng.uniform(0, 0.3, 900), np.zeros(900)])
    up = np.tile([0.0, 0.0, 1.0], (900, 1))
    assert len(boundary_loops(object_mesh(PointCloud(plate, up, "m"), 0.02).faces)) == 1
