"""Removal against closed forms: plate, overlapping passes, cylinder, sphere, edge."""

from __future__ import annotations

import numpy as np
import pytest

from builders.plate_passes import FEED, cylinder, passes
from nrdf.errors import ProcessError
from nrdf.process_model.cells import Cells, plate
from nrdf.process_model.moves import Moves
from nrdf.process_model.removal import Pad, removal, winkler_pressure
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

ORBITAL = Pad(0.03, 2e7, 5e-9, 20.0, spindle_rad_s=1000.0, orbit_m=0.0025)
SPINNING = Pad(0.03, 2e7, 5e-9, 20.0, spindle_rad_s=300.0)


def depth(mesh, segments, pad):
    cells = Cells.of(RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool)), 1.0, 0.0)
    moves = Moves.of(segments, pad.radius_m / 20.0)
    feeds = moves.feeds_m_s[moves.samples.column]
    matrix = removal(cells, moves.samples, len(moves.lengths_m), pad, feeds)
    return cells, matrix @ moves.slowness


def middle(cells):
    return np.abs(cells.centres[:, 1]) < 0.02


def strip(pad, x):
    """Depth across one pass on a plate, from integrals over the disc's chords."""
    half = np.sqrt(np.maximum(pad.radius_m**2 - x**2, 0.0))
    share = (np.arange(400) + 0.5) / 200.0 - 1.0
    y = half[:, None] * share
    around = np.hypot(x[:, None], y)
    if pad.orbit_m:
        speed = pad.spindle_rad_s * pad.orbit_m + FEED**2 / (4 * pad.spindle_rad_s * pad.orbit_m)
        speed = np.full_like(around, speed)
    else:  # the spin, about the tool's axis into the plate, leads along the travel on one side
        turn = pad.spindle_rad_s
        speed = np.sqrt((turn * y) ** 2 + (turn * x[:, None] - FEED) ** 2)
    pressure = pad.force_n / (np.pi * pad.radius_m**2)
    return pad.preston_per_pa * pressure * speed.mean(axis=1) * 2.0 * half / FEED


@pytest.mark.parametrize("pad", [ORBITAL, SPINNING])
@pytest.mark.parametrize("offsets", [[0.0], [-0.02, 0.005, 0.03]])
def test_passes_on_a_plate(pad, offsets):
    cells, found = depth(plate(0.2, 0.3, 0.003), passes(offsets, 0.2, 0.0), pad)
    x = cells.centres[:, 0]
    exact = np.sum([strip(pad, x - at) for at in offsets], axis=0)
    inner = middle(cells) & (np.abs(np.abs(x[:, None] - offsets) - pad.radius_m) > 0.003).all(1)
    assert np.abs(found - exact)[inner].max() < 0.015 * exact.max()
    across = np.linspace(-0.06, 0.07, 2001)
    whole = np.sum([strip(pad, across - at) for at in offsets], axis=0).mean() * 0.13
    worn = (found * cells.areas_m2)[middle(cells)].sum() / cells.areas_m2[middle(cells)].sum() * 0.2
    assert worn == pytest.approx(whole, rel=0.01)


def test_a_pass_along_a_cylinder_presses_on_a_strip():
    radius, soft = 0.5, Pad(0.03, 5e8, 5e-9, 20.0, 1000.0, 0.0025)
    mesh = cylinder(radius, 0.08, 0.3, 0.0015)
    cells, found = depth(mesh, passes([0.0], 0.2, 0.0), soft)
    # Pressure K (d - x²/2R) over chords of the disc carries the force.
    x = np.linspace(-soft.radius_m, soft.radius_m, 20_001)
    chord = 2.0 * np.sqrt(soft.radius_m**2 - x**2)

    def carried(d):
        return np.trapezoid(np.maximum(d - x**2 / 2 / radius, 0.0) * chord, x) * 5e8

    low, high = 0.0, 0.01
    for _ in range(60):
        low, high = ((low + high) / 2, high) if carried((low + high) / 2) < 20 else (
            low, (low + high) / 2)  # fmt: skip
    across = cells.centres[:, 0]
    speed = 2.5 + FEED**2 / 10.0
    pressure = 5e8 * np.maximum(low - across**2 / 2 / radius, 0.0)
    exact = 5e-9 * pressure * speed * 2.0 * np.sqrt(
        np.maximum(soft.radius_m**2 - across**2, 0.0)) / FEED  # fmt: skip
    inner = middle(cells)
    assert np.abs(found - exact)[inner].max() < 0.01 * exact.max()


def test_a_ball_is_pressed_on_a_cap_of_the_closed_form():
    radius, force, stiffness = 0.3, 5.0, 1e9
    flat = plate(0.05, 0.05, 0.0006)
    x, y = flat.vertices[:, 0], flat.vertices[:, 1]
    mesh = TargetMesh(np.stack([x, y, -(x**2 + y**2) / (2 * radius)], axis=1), flat.faces)
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    area = mesh.face_areas * mesh.face_normals[:, 2]
    pressure = winkler_pressure(np.zeros(len(area), int), -centres[:, 2], area, force, stiffness)
    away = np.hypot(centres[:, 0], centres[:, 1])
    wide = (4.0 * force * radius / (np.pi * stiffness)) ** 0.25
    exact = stiffness * np.maximum(wide**2 - away**2, 0.0) / (2.0 * radius)
    assert np.abs(pressure - exact).max() < 0.01 * exact.max()
    assert (pressure * area).sum() == pytest.approx(force)


def test_more_is_taken_off_where_the_pad_hangs_over_an_edge():
    cells, found = depth(plate(0.1, 0.3, 0.003), passes([0.05], 0.2, 0.0), ORBITAL)
    x = cells.centres[:, 0]
    one, half = strip(ORBITAL, np.array([0.004]))[0], middle(cells) & (np.abs(x - 0.046) < 0.003)
    assert found[half].mean() == pytest.approx(2.0 * one, rel=0.03)


def test_a_pad_that_there_is_not_is_refused():
    with pytest.raises(ProcessError, match="radius_m of 0"):
        Pad(0.0, 2e7, 5e-9, 20.0)
    with pytest.raises(ProcessError, match="orbit_m of -1"):
        Pad(0.03, 2e7, 5e-9, 20.0, orbit_m=-1.0)
