"""The smooth surface that a cloud stands for."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import SPACING, board, dome, slats, two_sided
from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.sampling import indices_in_subset
from nrdf.surface.surface import MOST_POINTS, Surface, surface_subset


def test_the_spacing_of_random_points_is_that_of_their_density():
    assert Surface(*board(spacing=0.005)).spacing == pytest.approx(0.005, rel=0.05)


def test_edges_keep_to_one_side_of_a_thin_board():
    surface = Surface(*two_sided())
    i, j = surface.edges.T
    assert (surface.normals[i, 2] == surface.normals[j, 2]).all()
    # Though the other side's points are nearer than most neighbours of one side.
    assert len(np.unique(surface.edges)) == len(surface.points)
    assert (i < j).all() and len(np.unique(surface.edges, axis=0)) == len(i)


def surface_of(points, normals):
    """The surface of a whole cloud."""
    kept = surface_subset(points, normals)
    return Surface(points[kept], normals[kept])


def test_repeated_points_are_one_and_the_two_sides_of_a_sheet_are_two():
    points, normals = board()
    plain = Surface(points, normals)
    again = surface_of(np.concatenate([points, points[:40], points[:7]]),
                       np.concatenate([normals, normals[:40], normals[:7]]))  # fmt: skip
    np.testing.assert_array_equal(again.points, plain.points)
    np.testing.assert_array_equal(again.edges, plain.edges)
    sheet = surface_of(np.concatenate([points, points]), np.concatenate([normals, -normals]))
    assert len(sheet.points) == 2 * len(points)
    nearly = points[:9] + 1e-9
    surface = surface_of(np.concatenate([points, nearly]), np.concatenate([normals, normals[:9]]))
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


def test_at_an_edge_the_nearest_sheet_that_faces_the_tool_counts():
    top, up = board()
    side = top[:, [0, 2, 1]] - [0.0, 0.0, 0.3]  # a wall down from the edge y = 0, facing -y
    surface = Surface(np.r_[top, side], np.r_[up, -up[:, [0, 2, 1]]])
    slanted = np.array([[0.0, -0.8, 0.6]])  # a tool that leans over the edge
    outside = np.array([[0.2, -0.003, -0.05]])  # before the wall, under the top
    found, normals, off = surface.nearest(outside, slanted)
    assert off[0] == pytest.approx(0.003, abs=1e-6)
    np.testing.assert_allclose(found[0], [0.2, 0.0, -0.05], atol=1e-6)
    np.testing.assert_allclose(normals[0], [0.0, -1.0, 0.0], atol=1e-6)


def test_where_there_is_no_surface_the_distance_is_infinite():
    surface = Surface(*board())
    beside = np.array([[0.2, 0.36, 0.0], [0.2, 0.15, 0.004]])
    off = surface.nearest(beside, np.array([[0.0, 0.0, 1.0]] * 2))[2]
    assert np.isinf(off[0]) and off[1] == pytest.approx(0.004)


def test_far_from_any_surface_a_point_stays_where_it_is():
    surface = Surface(*board())
    away = np.array([[0.2, 0.15, 5.0]])
    sideways = np.array([[1.0, 0.0, 0.0]])
    np.testing.assert_array_equal(surface.project(away, sideways)[0], away)
    np.testing.assert_array_equal(surface.smooth_normals(away, sideways, 0.03), sideways)


def test_a_large_cloud_is_thinned_and_regions_follow():
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(0, 1, (3 * MOST_POINTS, 2)), np.zeros(3 * MOST_POINTS)]
    subset = surface_subset(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    assert len(subset) == MOST_POINTS
    chosen = np.flatnonzero(points[:, 0] < 0.5)
    kept = indices_in_subset(subset, chosen, len(points))
    assert (points[subset[kept], 0] < 0.5).all()
    assert len(kept) == (points[subset, 0] < 0.5).sum()


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ([], "indices of one or more"),
        ([0.5], "indices of one or more"),
        ([-1, 3], r"indices -1 to 3; the cloud's are 0 to 1199"),
        ([5, 1200], r"indices 5 to 1200; the cloud's are 0 to 1199"),
    ],
)
def test_a_region_that_is_not_of_the_cloud_is_refused(region, message):
    surface = Surface(*board())
    assert len(surface.points) == 1200 and SPACING == 0.01
    with pytest.raises(ProcessError, match=message):
        surface.check_region(np.array(region))


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
    found, outward, off = surface.nearest(asked, np.tile([1.0, 0.0, 0.0], (3, 1)))
    np.testing.assert_allclose(found[:, 0], 0.41, atol=1e-6)
    np.testing.assert_allclose(outward, np.tile([1.0, 0.0, 0.0], (3, 1)), atol=1e-6)
    np.testing.assert_allclose(off, 0.002, atol=1e-6)
