"""Distances from a closed border, beside morphology on a grid of pixels."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.closed_border import ClosedBorder
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.strategy import Strategy

PIXEL, RADIUS = 0.004, 0.02


def flat(filled, height=0.0):
    """A flat region of the pixels (r, c) that are filled."""
    rows, columns = filled.shape
    x, y = np.meshgrid(np.arange(rows + 1), np.arange(columns + 1), indexing="ij")
    corners = np.stack([x, y, np.full(x.shape, height / PIXEL)], axis=-1).reshape(-1, 3) * PIXEL
    number = np.arange(len(corners)).reshape(rows + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1)[filled].reshape(-1, 3)
    return corners, faces


def region(*meshes):
    corners, faces = meshes[0]
    for more, others in meshes[1:]:
        faces = np.concatenate([faces, others + len(corners)])
        corners = np.concatenate([corners, more])
    mesh = TargetMesh(corners, faces)
    return RegionMesh.from_faces(mesh, np.ones(len(faces), bool))


def by_pixels(filled):
    """The distance of the filled pixels' corners from the closing's outside, by brute force."""
    wide = np.pad(filled, 20)
    fine = np.kron(wide, np.ones((4, 4), bool))
    places = (np.argwhere(np.ones_like(fine)) + 0.5) * PIXEL / 4 - 20 * PIXEL
    away = cKDTree(places[fine.ravel()]).query(places)[0]
    return cKDTree(places[away >= RADIUS])


def frame(gap):
    filled = np.ones((60, 40), bool)
    for start in (10, 10 + gap + 8):
        filled[start : start + gap, 8:-8] = False
    return filled


def ragged():
    filled = np.ones((60, 40), bool)
    filled[:, :3] = filled[:, -3:] = np.random.default_rng(0).random((60, 3)) < 0.4
    return filled


@pytest.mark.parametrize("filled", [frame(8), frame(14), ragged()], ids=["slats", "bars", "teeth"])
def test_the_border_is_the_closing_s(filled):
    corners, faces = flat(filled)
    used = corners[np.unique(faces)]
    found = ClosedBorder.of(region((corners, faces)), RADIUS).distance(used)
    true = by_pixels(filled).query(used[:, :2])[0] - RADIUS
    assert np.abs(found - true).max() < 0.35 * PIXEL + 0.05 * RADIUS


def test_slats_near_each_other_have_no_border_between_them_and_bars_far_apart_have():
    slats, bars = (ClosedBorder.of(region(flat(frame(gap))), RADIUS) for gap in (8, 14))
    assert slats.distance(np.array([[0.088, 0.08, 0.0]]))[0] > 0.05
    assert bars.distance(np.array([[0.112, 0.08, 0.0]]))[0] == pytest.approx(0.016, abs=0.002)


def test_slats_with_ragged_ends_are_worked_inside_the_margin():
    filled = frame(8)
    filled[:10] = filled[-10:] = True
    filled &= np.random.default_rng(1).random(filled.shape) > 0.02
    slats = region(flat(filled))
    strategy = Strategy(stepover_m=0.016, tool_radius_m=RADIUS, edge_margin_m=0.012)
    found = measure_path(slats, strategy, plan_on_mesh(slats, strategy))
    assert found.coverage > 0.95 and found.left_out["edge_margin"] < 0.05


def test_the_other_side_of_a_sheet_fills_no_gap():
    corners, faces = flat(frame(14))
    back, behind = flat(np.ones((60, 40), bool), height=-0.005)
    both = region((corners, faces), (back, behind[:, ::-1]))
    alone = region((corners, faces))
    used = corners[np.unique(faces)]
    expected = ClosedBorder.of(alone, RADIUS).distance(used)
    np.testing.assert_allclose(ClosedBorder.of(both, RADIUS).distance(used), expected, atol=1e-3)


def test_what_closes_around_itself_has_no_border():
    ball = trimesh.creation.icosphere(3, 0.1)
    mesh = TargetMesh(np.array(ball.vertices), np.array(ball.faces))
    whole = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    assert np.isinf(ClosedBorder.of(whole, RADIUS).distance(mesh.vertices)).all()
