"""Marching cubes where the surface is: whole on sparse points, two-sided on thin sheets."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from builders.surfaces import two_sided
from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.scan_grid import zero_surface
from nrdf.surface.scan_points import ScanPoints


def ball_scan(count: int, spacing: float, cell: float) -> ScanPoints:
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return ScanPoints(0.1 * normals, normals, np.full(count, spacing), np.zeros(count), cell)


def test_random_points_of_a_closed_surface_have_a_closed_mesh():
    scan = ball_scan(1500, 0.009, 0.006)
    vertices, faces = zero_surface(scan, cKDTree(scan.points))
    assert (opposite_half_edges(faces) >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.1, atol=2e-3)
    a, b, c = (vertices[corner] for corner in faces.T)
    assert (np.einsum("fa,fa->f", np.cross(b - a, c - a), a) > 0.0).all()


def test_cells_that_no_point_is_near_are_left_open():
    scan = ball_scan(3000, 0.006, 0.005)
    there = scan.points[:, 2] > 0.0
    half = ScanPoints(
        *(a[there] for a in (scan.points, scan.normals, scan.spacing, scan.offset)), 0.005
    )
    vertices, faces = zero_surface(half, cKDTree(half.points))
    assert (opposite_half_edges(faces) < 0).any()
    assert -0.03 < vertices[:, 2].min() < 0.0


@pytest.mark.parametrize("offset", [0.0, 0.003])
def test_a_sheet_thinner_than_a_cell_is_there_once_it_is_thickened(offset):
    points, normals = two_sided(thickness=0.002)
    scan = ScanPoints(
        points, normals, np.full(len(points), 0.01), np.full(len(points), offset), 0.0055
    )
    vertices, faces = zero_surface(scan, cKDTree(points))
    a, b, c = (vertices[corner] for corner in faces.T)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0
    whole = 2.0 * np.prod(np.ptp(points, axis=0)[:2])
    assert (area > 0.9 * whole) == (offset > 0.0)
