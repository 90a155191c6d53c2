"""Sparse clouds as closed meshes."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.mesh_edges import boundary_loops
from nrdf.surface.poisson_mesh import poisson_mesh
from nrdf.surface.target_mesh import TargetMesh


def border_length(mesh: TargetMesh) -> float:
    loops = [mesh.vertices[loop] for loop in boundary_loops(mesh.faces)]
    return sum(np.linalg.norm(loop - np.roll(loop, 1, axis=0), axis=1).sum() for loop in loops)


@pytest.mark.parametrize("count", [500, 4000])
def test_a_ball_of_random_points_is_whole_and_round(count):
    away = np.random.default_rng(0).normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]
    mesh = poisson_mesh(0.4 * away, away)
    assert border_length(mesh) < 0.005
    assert mesh.face_areas.sum() == pytest.approx(4 * np.pi * 0.16, rel=0.03)
    facing = np.einsum("fa,fa->f", mesh.face_normals, mesh.vertices[mesh.faces[:, 0]])
    assert (facing > 0.0).mean() > 0.999


def test_a_few_bad_normals_do_no_harm():
    stick = trimesh.creation.cylinder(0.02, 0.5)
    points, face = trimesh.sample.sample_surface(stick, 1500, seed=0)
    normals = np.array(stick.face_normals[face])
    normals[::25] *= -1
    mesh = poisson_mesh(points, normals)
    assert border_length(mesh) < 0.005
    radial = np.linalg.norm(mesh.vertices[np.abs(mesh.vertices[:, 2]) < 0.23, :2], axis=1)
    assert np.quantile(np.abs(radial - 0.02), 0.95) < 0.003


def test_the_surface_ends_where_the_points_end():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 0.4, 4000), rng.uniform(0, 0.3, 4000), np.zeros(4000)])
    mesh = poisson_mesh(points, np.tile([0.0, 0.0, 1.0], (4000, 1)))
    assert mesh.vertices[:, 0].min() > -0.01 and mesh.vertices[:, 0].max() < 0.41
    assert np.abs(mesh.vertices[:, 2]).max() < 0.001
