"""Shapes of regions that are known, and found regions beside given ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.mesh_targets import PLATE, plate_target, rows_on_top
from nrdf.geometry.mesh import Mesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf_benchmark.mesh_paths.measure import measure_mesh_path
from nrdf_benchmark.mesh_paths.region_shape import RegionMatch, is_curved, parts_in_space


def cylinder(radius: float, count: int = 4000):
    rng = np.random.default_rng(0)
    angle, z = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, 0.4, count)
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return radius * normals + np.stack([0 * z, 0 * z, z], axis=1), normals


def test_four_legs_are_four_parts_and_specks_none():
    leg, _ = cylinder(0.02)
    area = 2 * np.pi * 0.02 * 0.4 / len(leg)
    legs = [leg + np.array([x, y, 0.0]) for x in (0.0, 0.3) for y in (0.0, 0.3)]
    assert parts_in_space(np.concatenate([*legs, leg[:5] + 0.15]), area, 0.025) == 4
    assert parts_in_space(leg[:5], area, 0.025) == 1


def test_a_plate_is_flat_and_a_rod_is_curved():
    skin, own = plate_target().skin, plate_target().indices("top")
    assert not is_curved(skin.points[own], skin.normals[own], 0.025)
    assert is_curved(*cylinder(0.05), 0.025)


def test_what_was_left_out_is_told_from_what_was_not_reached():
    target = plate_target()
    mesh = TargetMesh.from_mesh(Mesh(target.vertices, target.faces))
    top = np.flatnonzero(mesh.face_normals[:, 2] > 0.9)
    half = np.zeros(len(mesh.faces), bool)
    half[top[0]] = True
    found = RegionMesh.from_faces(mesh, half)
    match = RegionMatch.of(target, "top", found)
    assert match.iou == pytest.approx(0.5, abs=0.03)
    assert match.inside.mean() == pytest.approx(0.5, abs=0.03)
    diagonal = float(np.hypot(0.4, 0.2))
    assert match.border_ratio == pytest.approx((0.6 + diagonal) / 1.2, rel=1e-3)
    path = rows_on_top(np.arange(-0.0875, 0.0, 0.025))
    figures = measure_mesh_path(target, "top", path, PLATE, found)
    assert 1.0 - figures.coverage == pytest.approx(figures.unreached / match.inside.mean())
    assert figures.no_clearance == 0.0
    assert 0.05 < figures.left_out < 0.4 and 0.1 < figures.unreached < 0.4
    whole = measure_mesh_path(target, "top", path, replace(PLATE, tool_radius_m=0.03))
    assert whole.left_out == 0.0 and whole.unreached > 0.4 and whole.iou is None
