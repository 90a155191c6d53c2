"""Contour-parallel lines and spirals."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import board, slats
from nrdf.surface.patch import Patch, patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.contour import contour, spiral

STEP = 0.025


def disc(radius: float = 0.2) -> Patch:
    points, normals = board(length=2 * radius, width=2 * radius, spacing=0.006)
    inside = np.linalg.norm(points[:, :2] - radius, axis=1) < radius
    surface = Surface(points[inside] - [radius, radius, 0.0], normals[inside])
    return patches_of(surface, np.arange(len(surface.points)))[0]


def length(path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2)


def test_rings_on_a_disc_are_closed_even_and_nested():
    (rings,) = contour(disc(), STEP, 0.0)
    assert len(rings) == 8
    for ring in rings:
        np.testing.assert_array_equal(ring[0], ring[-1])
        assert area(ring) > 0.0
    radii = [length(ring) / (2 * np.pi) for ring in rings]
    np.testing.assert_allclose(np.diff(radii), -STEP, atol=0.004)
    starts = np.array([ring[0] for ring in rings])
    assert (np.linalg.norm(np.diff(starts, axis=0), axis=1) < 1.6 * STEP).all()


def test_the_margin_is_kept():
    patch = disc()
    for paths in (contour(patch, STEP, 0.04), spiral(patch, STEP, 0.04)):
        places = np.concatenate([path for block in paths for path in block])
        assert patch.border.distance(places).min() > 0.04


def test_a_spiral_on_a_disc_is_one_stroke_that_sinks_by_a_stepover_a_turn():
    patch = disc()
    ((path,),) = spiral(patch, STEP, 0.0)
    depth = patch.border.distance(path)
    centre = patch.uv.mean(axis=0)
    turns = np.unwrap(np.arctan2(*(path - centre).T[::-1])) / (2 * np.pi)
    assert np.ptp(turns) == pytest.approx(9, abs=0.5)  # 8 rings, the first and last whole
    assert depth[-5:].mean() > depth[:5].mean() + 6 * STEP
    sunk = np.interp(np.arange(1.0, 8.0), np.abs(turns - turns[0]), depth)
    np.testing.assert_allclose(np.diff(sunk), STEP, atol=0.012)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert steps.max() < 2 * STEP


def test_rings_go_round_a_gap():
    points, normals = slats(gap=0.06)
    surface = Surface(points, normals)
    (patch,) = patches_of(surface, np.arange(len(surface.points)))
    (rings,) = contour(patch, STEP, 0.0)
    for ring in rings:
        x, y, _ = patch.at(ring)[0].T
        assert not ((np.abs(x - 0.2) < 0.02) & (np.abs(y - 0.15) < 0.08)).any()


def test_where_rings_part_each_branch_has_a_spiral():
    points, normals = board()
    neck = (np.abs(points[:, 0] - 0.2) < 0.05) & (np.abs(points[:, 1] - 0.15) > 0.05)
    surface = Surface(points[~neck], normals[~neck])
    (patch,) = patches_of(surface, np.arange(len(surface.points)))
    (paths,) = spiral(patch, STEP, 0.0)
    assert len(paths) >= 3
    long_ones = sorted(map(length, paths))[-2:]
    assert long_ones[0] > 0.8
