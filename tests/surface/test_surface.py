"""The smooth surface that a cloud stands for."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import board, dome, slats, two_sided
from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.surface.surface import Surface


def test_the_spacing_of_random_points_is_that_of_their_density():
    assert Surface(*board(spacing=0.005)).spacing == pytest.approx(0.005, rel=0.05)


def test_edges_keep_to_one_side_of_a_thin_board():
    surface = Surface(*two_sided())
    i, j = surface.edges.T
    assert (surface.normals[i, 2] == surface.normals[j, 2]).all()
    # Though the other side's points are nearer than most neighbours of one side.
    assert len(np.unique(surface.edges)) == len(surface.points)
    assert (i < j).all() and len(np.unique(surface.edges, axis=0)) == len(i)


def test_nearly_repeated_points_have_no_edge_between_them():
    points, normals = board()
    nearly = points[:9] + 1e-9
    surface = Surface(np.concatenate([points, nearly]), np.concatenate([normals, normals[:9]]))
    i, j = surface.edges.T
    assert np.linalg.norm(surface.points[i] - surface.points[j], axis=1).min() > 1e-6


def test_edges_do_not_cross_a_gap():
    surface = Surface(*slats(gap=0.06))
    x, y = surface.points[surface.edges][..., 0], surface.points[surface.edges][..., 1]
    inside = (np.abs(y - 0.15) < 0.08).all(axis=1)
    across = (x.min(axis=1) < 0.2) & (x.max(axis=1) > 0.2)
    assert not (inside & across).any()


def test_points_are_brought_onto_a_sphere_and_their_normals_with_them():
    points, normals = dome()
    surface = Surface(points, normals)
    inner = points[normals[:, 2] > np.cos(0.8)][:300]
    off = inner * np.random.default_rng(0).uniform(0.98, 1.02, (len(inner), 1))
    found, outward = surface.project(off, unit_vectors(inner))
    assert np.abs(np.linalg.norm(found, axis=1) - 0.25).max() < 2e-4
    assert (np.einsum("na,na->n", outward, unit_vectors(inner)) > np.cos(np.radians(2))).all()


def test_noise_is_smoothed():
    points, normals = board(spacing=0.006)
    rough = points + normals * np.random.default_rng(0).normal(0, 1e-3, (len(points), 1))
    surface = Surface(rough, normals)
    inner = (np.abs(points - [0.2, 0.15, 0]) < [0.17, 0.12, 1]).all(axis=1)
    found, _ = surface.project(rough[inner], normals[inner])
    assert np.abs(found[:, 2]).mean() < 0.65 * np.abs(rough[inner, 2]).mean()


def test_the_sides_of_a_thin_board_are_not_mixed():
    surface = Surface(*two_sided(thickness=0.004))
    between = np.array([[0.2, 0.15, -0.002]] * 2)
    up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found, normals = surface.project(between, up)
    np.testing.assert_allclose(found[:, 2], [0.0, -0.004], atol=1e-9)
    np.testing.assert_allclose(normals, up, atol=1e-9)
    np.testing.assert_allclose(surface.smooth_normals(between, up, 0.03), up, atol=1e-12)


def test_far_from_any_surface_a_point_stays_where_it_is():
    surface = Surface(*board())
    away = np.array([[0.2, 0.15, 5.0]])
    sideways = np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(surface.project(away, sideways)[0], away)
    np.testing.assert_array_equal(surface.smooth_normals(away, sideways, 0.03), sideways)


def test_points_without_normals_that_fit_are_refused():
    points, normals = board()
    with pytest.raises(ProcessError, match=r"\(1200, 3\) and normals \(1199, 3\)"):
        Surface(points, normals[1:])
    with pytest.raises(ProcessError, match="at least 8 finite points with normals, not 5"):
        Surface(points[:5], normals[:5])
    with pytest.raises(ProcessError, match="at least 8 finite points"):
        Surface(np.where(points == points[3], np.nan, points), normals)


def test_few_points_at_a_thin_parts_end_are_a_plane_of_their_own():
    points, normals = board(spacing=0.012)
    end = np.array([[0.41, 0.1, -0.003], [0.41, 0.12, -0.006], [0.41, 0.14, -0.004]])
    surface = Surface(np.r_[points, end], np.r_[normals, np.tile([1.0, 0.0, 0.0], (3, 1))])
    asked = end + np.array([0.002, 0.003, 0.0])
    found, outward = surface.project(asked, np.tile([1.0, 0.0, 0.0], (3, 1)))
    np.testing.assert_allclose(found[:, 0], 0.41, atol=1e-6)
    np.testing.assert_allclose(outward, np.tile([1.0, 0.0, 0.0], (3, 1)), atol=1e-6)
