"""Scans as meshes: near the true surface, open where nothing was seen, thin sheets two-sided."""

import numpy as np
import pytest
import trimesh

from nrdf.errors import ProcessError
from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.scan_mesh import mesh_from_scan


def sphere_points(count: int = 6000, noise: float = 0.001) -> tuple[np.ndarray, np.ndarray]:
    """The upper half of a ball of radius 0.1 m, from a scan with noise."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(count, 3))
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals * (0.1 + noise * rng.normal(size=(count, 1))), normals


def test_noise_is_smoothed_away_and_what_was_not_seen_stays_open():
    mesh = mesh_from_scan(*sphere_points(), 0.004)
    off = np.abs(np.linalg.norm(mesh.vertices, axis=1) - 0.1)
    assert np.median(off) < 3e-4 and np.percentile(off, 99) < 1.5e-3
    assert mesh.face_areas.sum() == pytest.approx(2 * np.pi * 0.01, rel=0.1)
    assert mesh.vertices[:, 2].min() > -0.004
    outward = np.einsum("fa,fa->f", mesh.face_normals, mesh.vertices[mesh.faces].mean(axis=1))
    assert (outward > 0.0).all()
    assert 0.002 < mesh.edge_length < 0.006


def test_both_sides_of_a_thin_plate_are_there():
    shape = trimesh.creation.box((0.2, 0.2, 0.002))
    points, face = trimesh.sample.sample_surface(shape, 6000, seed=0)
    normals = shape.face_normals[face]
    seen = np.abs(normals[:, 2]) > 0.5
    mesh = mesh_from_scan(np.asarray(points)[seen], normals[seen], 0.004)
    for side in (-1.0, 1.0):
        facing = side * mesh.face_normals[:, 2] > 0.9
        assert mesh.face_areas[facing].sum() == pytest.approx(0.04, rel=0.1)
        heights = side * mesh.vertices[mesh.faces[facing]][..., 2]
        assert np.abs(heights - 0.001).max() < 2e-4


@pytest.mark.parametrize("count", [500, 2000, 20_000])
def test_random_points_on_a_ball_have_a_whole_surface(count):
    rng = np.random.default_rng(count)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    mesh = mesh_from_scan(0.4 * normals, normals, 0.005)
    assert (opposite_half_edges(mesh.faces) >= 0).all()
    assert mesh.face_areas.sum() == pytest.approx(4 * np.pi * 0.16, rel=0.01)


def test_a_true_hole_stays_open():
    points, normals = sphere_points(20_000)
    there = np.linalg.norm(points - [0.0, 0.0, 0.1], axis=1) > 0.02
    mesh = mesh_from_scan(points[there], normals[there], 0.004)
    away = np.linalg.norm(mesh.vertices - [0.0, 0.0, 0.1], axis=1)
    assert 0.016 < away.min() < 0.021


@pytest.mark.parametrize(
    ("count", "edge", "message"),
    [
        (10, 0.01, "at least 50 points"),
        (100, 0.0, "above 0 m"),
        (100, np.nan, "above 0 m"),
    ],
)
def test_what_is_no_scan_is_refused(count, edge, message):
    points, normals = sphere_points(count)
    with pytest.raises(ProcessError, match=message):
        mesh_from_scan(points, normals, edge)


def test_points_that_are_not_finite_are_refused():
    points, normals = sphere_points(100)
    points[3, 1] = np.inf
    with pytest.raises(ProcessError, match="must be finite"):
        mesh_from_scan(points, normals, 0.01)
