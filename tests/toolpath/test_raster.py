"""Rasters: even along the surface."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import board, slats, tube
from nrdf.surface.patch import Patch, patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.raster import distance_from_row, raster, strip_middles


def patch_of(points: np.ndarray, normals: np.ndarray) -> Patch:
    return patches_of(Surface(points, normals), np.arange(len(points)))[0]


def placed(patch: Patch, paths: list[np.ndarray]) -> list[np.ndarray]:
    return [patch.at(path)[0] for path in paths]


@pytest.mark.parametrize(
    ("width", "middles"),
    [(0.1, [0.0125, 0.0375, 0.0625, 0.0875]), (0.03, [0.0075, 0.0225]), (0.01, [0.005])],
)
def test_strips_are_even_and_no_wider_than_a_stepover(width, middles):
    np.testing.assert_allclose(strip_middles(width, 0.025), middles)


def test_a_board_has_the_exact_number_of_lines_in_snake_order():
    patch = patch_of(*board(length=0.4, width=0.3, spacing=0.008))
    angle, _ = patch.angle_of(np.array([1.0, 0.0, 0.0]))
    (paths,) = raster(patch, angle, 0.032, 0.0)
    lines = placed(patch, paths)
    assert len(lines) == 10
    levels = [line[:, 1].mean() for line in lines]
    np.testing.assert_allclose(np.abs(np.diff(levels)), 0.03, atol=0.0015)
    assert len(set(np.sign(np.diff(levels)))) == 1
    for line in lines:
        assert np.ptp(line[:, 1]) < 1e-3
        assert np.ptp(line[:, 0]) == pytest.approx(0.4, abs=0.02)
    ahead = [np.sign(line[-1, 0] - line[0, 0]) for line in lines]
    assert ahead == [ahead[0] * (-1) ** k for k in range(10)]


def test_lines_are_broken_at_a_gap():
    patch = patch_of(*slats(gap=0.06))
    angle, _ = patch.angle_of(np.array([1.0, 0.0, 0.0]))
    (paths,) = raster(patch, angle, 0.03, 0.0)
    lines = placed(patch, paths)
    assert len(lines) > 11
    for line in lines:
        through = (np.abs(line[:, 0] - 0.2) < 0.02) & (np.abs(line[:, 1] - 0.15) < 0.08)
        assert not through.any()


def test_parts_that_a_margin_separates_have_blocks_of_their_own():
    points, normals = board()
    neck = (np.abs(points[:, 0] - 0.2) < 0.05) & (np.abs(points[:, 1] - 0.15) > 0.03)
    patch = patch_of(points[~neck], normals[~neck])
    assert len(raster(patch, 0.0, 0.03, 0.0)) == 1
    assert len(raster(patch, 0.0, 0.03, 0.045)) == 2
    assert raster(patch, 0.0, 0.03, 0.2) == []


def test_around_a_bend_lines_are_even_along_the_surface():
    patch = patch_of(*tube(radius=0.1, turn=np.pi))
    angle, _ = patch.angle_of(np.array([0.0, 0.0, 1.0]))
    (paths,) = raster(patch, angle, 0.03, 0.0)
    around = [np.arctan2(line[:, 1], line[:, 0]).mean() for line in placed(patch, paths)]
    assert len(around) == 11
    np.testing.assert_allclose(np.abs(np.diff(around)) * 0.1, np.pi * 0.1 / 11, rtol=0.08)


def test_the_distance_from_a_parallel_of_a_sphere_is_exact():
    """On a sphere in longitude and latitude, circles of latitude are evenly spaced."""
    pitch = 0.01
    latitude = pitch * np.arange(-60, 61)
    uu = np.repeat(np.cos(latitude)[:, None] ** 2, 80, axis=1)
    found = distance_from_row(uu, np.zeros_like(uu), np.ones_like(uu), pitch, 60)
    np.testing.assert_allclose(found, np.repeat(latitude[:, None], 80, axis=1), atol=1e-9)


def test_the_distance_from_a_slanted_line_in_skewed_coordinates_is_exact():
    """In the plane with x = u + 0.3 v, y = 2 v, rows are 2 pitches apart."""
    shape = (61, 50)
    metric = [np.full(shape, value) for value in (1.0, 0.3, 0.09 + 4.0)]
    found = distance_from_row(*metric, pitch=0.01, row=10)
    wanted = 0.02 * (np.arange(61) - 10)
    np.testing.assert_allclose(found, np.repeat(wanted[:, None], 50, axis=1), atol=1e-9)
