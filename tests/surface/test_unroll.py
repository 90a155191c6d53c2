"""Patches laid into the plane."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import pdist

from builders.surfaces import board, dome, tube
from nrdf.surface.surface import Surface
from nrdf.surface.unroll import unroll


def unrolled(points, normals):
    surface = Surface(points, normals)
    return unroll(surface.points, surface.normals, surface.edges, surface.spacing)


def test_a_flat_board_keeps_all_its_distances():
    points, normals = board()
    flat = unrolled(points, normals)
    np.testing.assert_allclose(pdist(flat.uv), pdist(points), rtol=0, atol=1e-5)
    assert flat.error.max() < 1e-5


def test_half_a_tube_unrolls_to_its_arc_length():
    points, normals = tube(turn=np.pi)
    flat = unrolled(points, normals)
    arc = np.c_[0.1 * np.arctan2(points[:, 1], points[:, 0]), points[:, 2]]
    np.testing.assert_allclose(pdist(flat.uv), pdist(arc), rtol=0, atol=4e-3)
    assert np.quantile(flat.error, 0.95) < 0.05


def test_three_quarters_of_a_tube_do_not_fold():
    points, normals = tube(turn=1.5 * np.pi)
    flat = unrolled(points, normals)
    assert np.ptp(flat.uv, axis=0).max() > 0.95 * 0.1 * 1.5 * np.pi


def test_a_closed_tube_cannot_be_unrolled_and_the_error_says_so():
    flat = unrolled(*tube(radius=0.03))
    assert (flat.error > 0.2).mean() > 0.3


def test_the_plane_is_seen_from_outside_and_its_axes_are_known_on_the_surface():
    for points, normals in (board(), tube(turn=2.0), dome()):
        flat = unrolled(points, normals)
        outward = np.cross(flat.tangents[:, 0], flat.tangents[:, 1])
        np.testing.assert_allclose(outward, normals, atol=1e-9)
        # A short step along u on the surface is that step along u in the plane.
        surface = Surface(points, normals)
        i, j = surface.edges[::7].T
        step = np.einsum("eba,ea->eb", flat.tangents[i], points[j] - points[i])
        error = np.linalg.norm(flat.uv[j] - flat.uv[i] - step, axis=1)
        assert np.quantile(error / np.linalg.norm(step, axis=1), 0.9) < 0.15
