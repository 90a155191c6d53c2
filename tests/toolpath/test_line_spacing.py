"""Distances between lines, along surfaces on which they are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.regions_of_shapes import plate, plate_with_hole, tube
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.line_spacing import line_spacing
from nrdf.toolpath.sampled_path import SampledPath

STEPOVER = 0.02


def spacing(region, lines, normals=None, stepover=STEPOVER):
    up = [np.tile([0.0, 0.0, 1.0], (len(line), 1)) for line in lines]
    axes = [-n for n in (up if normals is None else normals)]
    sampled = SampledPath.along(lines, axes, 0.003, 0.01)
    return line_spacing(region.mesh, sampled, stepover)


def row(y, first=0.02, last=0.38):
    x = np.linspace(first, last, 60)
    return np.stack([x, np.full_like(x, y), np.zeros_like(x)], axis=1)


def test_rows_are_as_far_apart_as_they_are():
    found = spacing(plate(), [row(y) for y in (0.05, 0.07, 0.10)])
    assert set(np.round(found, 6)) == {0.02, 0.03}


def test_what_is_joined_at_its_ends_is_measured_alike():
    rows = [row(0.05), row(0.07)[::-1], row(0.095)]
    joined = np.concatenate(rows)
    assert spacing(plate(), [joined]).max() == pytest.approx(0.025, abs=3e-4)


def test_lines_far_apart_or_across_each_other_are_no_neighbours():
    assert not len(spacing(plate(), [row(0.05), row(0.05 + 3.0 * STEPOVER)]))
    down = np.stack([np.full(30, 0.2), np.linspace(0.06, 0.18, 30), np.zeros(30)], axis=1)
    assert not len(spacing(plate(), [row(0.05), down]))


def test_a_hole_between_two_lines_parts_them():
    whole = plate_with_hole(0.4, 0.3, 0.05)
    x = np.linspace(-0.03, 0.03, 30)
    pair = [np.stack([x, np.full_like(x, y), 0 * x], axis=1) for y in (-0.051, 0.051)]
    wide = line_spacing(
        whole.mesh, SampledPath.along(pair, [np.tile([0, 0, -1.0], (30, 1))] * 2, 0.003, 0.01), 0.05
    )
    assert not len(wide)


def test_a_short_break_is_no_gap_and_a_long_one_is():
    short = [row(0.05), row(0.07, 0.02, 0.195), row(0.07, 0.205, 0.38), row(0.09)]
    assert spacing(plate(), short).max() < 1.15 * STEPOVER
    long = [row(0.05), row(0.07, 0.02, 0.15), row(0.07, 0.25, 0.38), row(0.09)]
    assert spacing(plate(), long).max() > 1.9 * STEPOVER


def test_around_a_tube_arcs_count_not_chords():
    region, angles = tube(0.03), np.arange(8) * np.pi / 4
    x = np.linspace(0.02, 0.38, 60)
    outward = [np.array([0.0, np.cos(a), np.sin(a)]) for a in angles]
    lines = [0.03 * n + np.stack([x, 0 * x, 0 * x], axis=1) for n in outward]
    found = spacing(region, lines, [np.tile(n, (60, 1)) for n in outward])
    np.testing.assert_allclose(found, 0.03 * np.pi / 4, rtol=0.01)


def test_the_other_side_of_a_sheet_is_not_beside():
    lines, low = [row(0.05), row(0.06)], [0.0, 0.0, 0.001]
    sides = [np.tile([0.0, 0.0, z], (60, 1)) for z in (1.0, -1.0)]
    assert not len(spacing(plate(), [lines[0], lines[1] - low], sides))


WIDE, THIN, LENGTH = 0.06, 0.02, 0.3


def bar():
    """The four long faces of a bar along z."""
    box = trimesh.creation.box((THIN, WIDE, LENGTH)).apply_translation((0, 0, LENGTH / 2))
    mesh = TargetMesh(np.array(box.vertices), np.array(box.faces))
    return RegionMesh.from_faces(mesh, np.abs(mesh.face_normals[:, 2]) < 0.5)


def along_bar(x, y, normal):
    z = np.linspace(0.02, LENGTH - 0.02, 27)
    return np.c_[np.full(27, x), np.full(27, y), z], np.tile(np.array(normal, float), (27, 1))


def round_the_bar():
    """Lines no farther than a stepover apart round the bar, some of them close to its edges."""
    levels = (-0.027, -0.009, 0.009, 0.027)
    faces = [along_bar(side * THIN / 2, y, (side, 0, 0)) for side in (-1.0, 1.0) for y in levels]
    return faces + [along_bar(0.0, side * WIDE / 2, (0, side, 0)) for side in (-1.0, 1.0)]


def test_lines_round_a_square_bar_are_beside_each_other_and_a_missing_one_is_missed():
    lines, normals = zip(*round_the_bar(), strict=True)
    assert spacing(bar(), list(lines), list(normals), 0.025).max() < 1.15 * 0.025
    fewer = [k for k in range(len(lines)) if k not in (1, 2)]
    found = spacing(bar(), [lines[k] for k in fewer], [normals[k] for k in fewer], 0.025)
    assert found.max() > 1.5 * 0.025


def test_a_line_that_faces_away_is_beside_none():
    pair = [along_bar(THIN / 2, y, (1, 0, 0)) for y in (-0.02, 0.02)]
    for lines in (pair, [*pair, along_bar(THIN / 2, 0.0, (-1, 0, 0))]):
        contacts, normals = zip(*lines, strict=True)
        np.testing.assert_allclose(
            spacing(bar(), list(contacts), list(normals), 0.025), 0.04, atol=1e-6
        )
