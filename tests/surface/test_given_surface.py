"""Distances from an object as it was given: a mesh's triangles, all points of a scan."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import nrdf
from builders.surfaces import board, dome, two_sided
from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud, in_metres, read_cloud
from nrdf.surface.given_surface import MeshSurface, PointSurface, given_surface
from nrdf.surface.object_mesh import object_mesh

BOX = trimesh.creation.box((1.0, 0.4, 0.6))
DOWN = np.array([[0.0, 0.0, -1.0]])


def cloud_of(mesh):
    points = np.asarray(BOX.sample(500, seed=0))
    return PointCloud(points, np.tile([0.0, 1.0, 0.0], (500, 1)), "m", mesh=mesh)


def test_distances_to_a_mesh_are_to_its_triangles():
    given = given_surface(cloud_of(Mesh(np.array(BOX.vertices), np.array(BOX.faces))))
    assert given.name == "the mesh as given (12 triangles)"
    places = np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.31], [0.0, 0.0, 0.29], [0.53, 0.24, 0.0]])
    away = given.distance(places, np.repeat(DOWN, 4, axis=0))
    np.testing.assert_allclose(away, [0.0, 0.01, 0.01, 0.05], atol=1e-12)
    assert given.distance(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".off", ".glb"])
def test_a_mesh_file_keeps_its_mesh_in_its_unit(tmp_path, suffix):
    path = tmp_path / f"box{suffix}"
    BOX.export(path)
    cloud = read_cloud(path, mesh_samples=500)
    assert len(cloud.mesh.faces) == 12
    metres = in_metres(cloud, "mm")
    np.testing.assert_allclose(np.ptp(metres.mesh.vertices, axis=0), [1e-3, 4e-4, 6e-4])
    assert cloud.select(np.arange(10)).mesh is cloud.mesh
    nrdf.write_cloud(tmp_path / "points.ply", cloud)
    assert read_cloud(tmp_path / "points.ply").mesh is None


@pytest.mark.parametrize(
    "mesh",
    [
        Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)),
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])),
        Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]])),
        Mesh(np.eye(3), np.array([[0, 1, 5], [0, -1, 2], [0, 0, 1]])),
        Mesh(np.eye(3) * 1e300, np.array([[0, 1, 2]])),
        Mesh(np.eye(3) * 1e-300, np.array([[0, 1, 2]])),
        Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]])),
        Mesh(np.zeros((4, 2)), np.zeros((1, 4), int)),
    ],
)
def test_a_mesh_that_native_code_must_not_see_is_none(mesh):
    assert isinstance(given_surface(cloud_of(mesh)), PointSurface)


def test_repeated_and_empty_triangles_are_no_trouble():
    faces = np.concatenate([BOX.faces, [[0, 0, 1]], BOX.faces])
    given = given_surface(cloud_of(Mesh(np.array(BOX.vertices), faces)))
    assert isinstance(given, MeshSurface)
    assert given.name == "the mesh as given (12 triangles)"
    assert given.distance(np.array([[0.0, 0.0, 0.35]]), DOWN)[0] == pytest.approx(0.05)


def test_a_mesh_that_is_known_already_is_not_repaired_again(monkeypatch):
    cloud = cloud_of(Mesh(np.array(BOX.vertices), np.array(BOX.faces)))
    known = object_mesh(cloud, 0.03)
    monkeypatch.setattr("nrdf.surface.target_mesh.repaired_skin", None)
    assert given_surface(cloud, known).name == "the mesh as given (12 triangles)"


def test_the_mesh_made_of_a_cloud_does_not_judge_it():
    points, normals = dome()
    cloud = PointCloud(points, normals, "m")
    assert isinstance(given_surface(cloud, object_mesh(cloud, 0.03)), PointSurface)


def test_the_surface_between_points_is_smooth():
    points, normals = dome()
    given = PointSurface(points, normals)
    rng = np.random.default_rng(3)
    at = normals[rng.permutation(len(normals))[:200]]
    at = at[at[:, 2] > np.cos(0.8)]  # not at the rim
    np.testing.assert_allclose(given.distance(0.25 * at, -at), 0.0, atol=2e-4)
    np.testing.assert_allclose(given.distance(0.253 * at, -at), 0.003, atol=3e-4)


def test_the_other_side_of_a_sheet_does_not_count():
    points, normals = two_sided(thickness=0.004)
    given = PointSurface(points, normals)
    inside = np.array([[0.2, 0.15, -0.003]])
    assert given.distance(inside, DOWN)[0] == pytest.approx(0.003, abs=1e-6)
    assert given.distance(inside, -DOWN)[0] == pytest.approx(0.001, abs=1e-6)


def test_points_tell_how_finely_they_can_tell():
    assert PointSurface(*board(spacing=0.01)).resolution_m == pytest.approx(0.005, rel=0.1)
    assert given_surface(cloud_of(Mesh(np.array(BOX.vertices), BOX.faces))).resolution_m == 0.0


def test_few_points_on_a_thin_rod_are_a_plane_not_nothing():
    """Between points 40 mm apart, places on the surface are nearer to it than to any point."""
    along = np.linspace(0.0, 0.4, 11)
    points = np.c_[along, np.zeros((11, 2))]
    given = PointSurface(points, np.tile([0.0, 0.0, 1.0], (11, 1)))
    assert given.distance(np.array([[0.1, 0.0, 0.001]]), DOWN)[0] == pytest.approx(1e-3, abs=1e-6)


def test_a_place_beyond_the_edge_or_in_the_air_is_off():
    """In the plane of the board, a hand's breadth beside it."""
    points, normals = board()
    given = PointSurface(points, normals)
    away = given.distance(
        np.array([[0.5, 0.15, 0.0], [0.2, 0.15, 0.1]]), np.repeat(DOWN, 2, axis=0)
    )
    np.testing.assert_allclose(away, [0.1, 0.1], atol=0.025)


def test_repeated_and_few_points_are_no_trouble():
    points = np.repeat([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], 30, axis=0)
    normals = np.tile([0.0, 0.0, 1.0], (60, 1))
    for some in (slice(None), slice(0, 30), slice(0, 2), slice(0, 1)):
        given = PointSurface(points[some], normals[some])
        away = given.distance(np.array([[0.0, 0.0, 0.2]]), DOWN)
        np.testing.assert_allclose(away, [0.2])


def test_all_points_count_not_the_thinned_ones():
    """A dent that is smaller than the distance between thinned points."""
    points, normals = board(spacing=0.002)
    points, normals = np.repeat(points, 5, axis=0), np.repeat(normals, 5, axis=0)
    dent = np.linalg.norm(points[:, :2] - [0.2, 0.15], axis=1) < 0.02
    points[dent, 2] = -0.004
    place = np.array([[0.2, 0.15, 0.0]])
    assert PointSurface(points, normals).distance(place, DOWN)[0] == pytest.approx(0.004, abs=1e-4)
