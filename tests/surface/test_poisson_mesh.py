"""Sparse clouds as closed meshes."""

import numpy as np
import pytest
import trimesh

from nrdf.surface.mesh_edges import boundary_loops
from nrdf.surface.poisson_mesh import poisson_mesh


@pytest.mark.parametrize("count", [500, 4000])
def test_a_ball_of_random_points_is_whole_and_round(count):
    away = np.random.default_rng(0).normal(size=(count, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]
    mesh = poisson_mesh(0.4 * away, away)
    assert boundary_loops(mesh.faces) == []
    assert mesh.face_areas.sum() == pytest.approx(4 * np.pi * 0.16, rel=0.03)
    assert (np.einsum("fa,fa->f", mesh.face_normals, mesh.vertices[mesh.faces[:, 0]]) > 0).all()


def test_a_few_bad_normals_do_no_harm():
    stick = trimesh.creation.cylinder(0.02, 0.5)
    points, face = trimesh.sample.sample_surface(stick, 1500, seed=0)
    normals = np.array(stick.face_normals[face])
    normals[::25] *= -1
    mesh = poisson_mesh(points, normals)
    assert boundary_loops(mesh.faces) == []
    assert np.quantile(np.abs(stick.nearest.signed_distance(mesh.vertices)), 0.95) < 0.004


def test_the_surface_ends_where_the_points_end():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(0, 0.4, 4000), rng.uniform(0, 0.3, 4000), np.zeros(4000)])
    mesh = poisson_mesh(points, np.tile([0.0, 0.0, 1.0], (4000, 1)))
    assert mesh.vertices[:, 0].min() > -0.01 and mesh.vertices[:, 0].max() < 0.41
    assert np.abs(mesh.vertices[:, 2]).max() < 0.001
