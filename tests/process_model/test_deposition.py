"""Film against closed forms: plate, overlapping passes, cylinder, sphere."""

from __future__ import annotations

import time

import numpy as np
import pytest

from builders.plate_passes import FEED, cylinder, passes
from nrdf.process_model.cells import Cells, plate
from nrdf.process_model.deposition import deposition
from nrdf.process_model.moves import Moves
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment

STANDOFF = 0.2
BETA = SprayProfile(0.08, 0.03, 2e-6, STANDOFF, across_exponent=2.5, along_exponent=2.5)
GAUSS = SprayProfile(0.03, 0.01, 2e-6, STANDOFF, "gaussian")


def film(mesh, segments, profile):
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    cells = Cells.of(region, 1.0, 0.0)
    moves = Moves.of(segments, profile.along_m / 4.0)
    matrix = deposition(cells, moves.samples, len(moves.lengths_m), profile, mesh)
    return cells, matrix @ moves.slowness


@pytest.mark.parametrize("profile", [BETA, GAUSS])
def test_one_pass_and_overlapping_passes_on_a_plate(profile):
    mesh = plate(0.24, 0.1, 0.004)
    for offsets in ([0.0], [-0.06, -0.02, 0.03]):
        cells, found = film(mesh, passes(offsets), profile)
        exact = sum(profile.strip(cells.centres[:, 0] - x, FEED) for x in offsets)
        assert np.abs(found - exact).max() < 0.01 * exact.max()


def test_a_pass_along_a_cylinder():
    radius = 0.08
    mesh = cylinder(radius, 0.9, 0.1, 0.004)
    cells, found = film(mesh, passes([0.0]), BETA)
    turn = np.arctan2(cells.centres[:, 0], cells.centres[:, 2] + radius)
    height = STANDOFF + radius * (1.0 - np.cos(turn))
    ratio = STANDOFF / height
    slant = np.cos(turn) - radius * np.sin(turn) ** 2 / height
    exact = ratio * slant * BETA.strip(radius * np.sin(turn) * ratio, FEED)
    assert np.abs(found - exact).max() < 0.01 * exact.max()


def test_a_dwell_over_a_sphere():
    radius, seconds = 0.1, 2.0
    flat = plate(0.14, 0.14, 0.004)
    x, y = flat.vertices[:, 0], flat.vertices[:, 1]
    vertices = np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2) - radius], axis=1)
    mesh = TargetMesh(vertices, flat.faces)
    round_fan = SprayProfile(0.06, 0.06, 2e-6, STANDOFF)
    held = np.array([[1.0, 0.0, 0.0, 0.0]])
    stop = Segment("process", 0, np.array([[0, 0, STANDOFF]]), held, FEED, dwell_s=seconds)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    cells = Cells.of(region, 1.0, 0.0)
    matrix = deposition(cells, Moves.of([stop], 0.01).stops, 1, round_fan, mesh)
    found = np.asarray(matrix.sum(axis=1)).ravel()
    away = np.hypot(cells.centres[:, 0], cells.centres[:, 1])
    turn = np.arcsin(away / radius)
    height = STANDOFF + radius * (1.0 - np.cos(turn))
    ratio = STANDOFF / height
    slant = np.cos(turn) - radius * np.sin(turn) ** 2 / height
    exact = seconds * ratio**2 * slant * round_fan.flux(away * ratio, 0.0 * away)
    assert np.abs(found - exact).max() < 0.01 * exact.max()
    assert (found * cells.areas_m2).sum() == pytest.approx(seconds * round_fan.flow_m3_s, rel=0.01)


def test_nothing_falls_behind_a_wall_or_on_a_back():
    ground = plate(0.2, 0.1, 0.005)
    wall = plate(0.1, 0.1, 0.005)
    upright = np.stack([0 * wall.vertices[:, 0] + 0.02, wall.vertices[:, 1],
                        0.05 + wall.vertices[:, 0]], axis=1)  # fmt: skip
    vertices = np.concatenate([ground.vertices, upright])
    faces = np.concatenate([ground.faces, wall.faces + len(ground.vertices)])
    mesh = TargetMesh(vertices, faces)
    cells, found = film(mesh, passes([-0.03]), BETA)
    at = cells.centres
    low = (at[:, 2] < 1e-6) & (np.abs(at[:, 1]) < 0.02)
    # The ray over the wall's top, 0.1 m high, comes down at twice its distance.
    shadow = low & (at[:, 0] > 0.025) & (at[:, 0] < 0.065)
    assert (found[shadow] == 0.0).all()
    assert (found[low & (at[:, 0] < 0.015)] > 0.0).all()
    behind = (at[:, 2] > 0.01) & (cells.normals[:, 0] > 0.5)
    assert (found[behind] == 0.0).all()


def test_ten_thousand_cells_are_quick():
    mesh = plate(0.6, 0.6, 0.0085)
    segments = passes(np.arange(-0.3, 0.3, 0.025), 0.6)
    begin = time.process_time()
    cells, _ = film(mesh, segments, BETA)
    assert len(cells.areas_m2) > 9_800
    assert time.process_time() - begin < 4.0
