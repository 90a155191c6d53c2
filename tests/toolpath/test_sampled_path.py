"""Which lines are beside each other, and how far apart."""

from __future__ import annotations

import numpy as np

from nrdf.surface.patch import Patch, patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.sampled_path import _placed, line_spacing, sample_lines
from nrdf.toolpath.surface_path import SurfacePath

WIDE, THIN, LENGTH, STEPOVER = 0.06, 0.02, 0.3, 0.025


def bar(spacing: float = 0.017) -> Surface:
    """The four long faces of a bar along z, of few points: one or two across its thin sides."""
    rng = np.random.default_rng(3)
    points, normals = [], []
    for axis, across, half in ((0, WIDE, THIN / 2), (1, THIN, WIDE / 2)):
        for side in (-1.0, 1.0):
            count = int(across * LENGTH / spacing**2)
            face = np.zeros((count, 3))
            face[:, axis], face[:, 1 - axis] = side * half, rng.uniform(-0.5, 0.5, count) * across
            face[:, 2] = rng.uniform(0.0, LENGTH, count)
            points.append(face)
            normals.append(np.tile(side * np.eye(3)[axis], (count, 1)))
    return Surface(np.concatenate(points), np.concatenate(normals))


def along(x: float, y: float, normal: tuple[float, float, float]) -> SurfacePath:
    z = np.linspace(0.02, LENGTH - 0.02, 27)
    return SurfacePath(np.c_[np.full(27, x), np.full(27, y), z], np.tile(normal, (27, 1)))


def round_the_bar() -> list[SurfacePath]:
    """Lines no farther than a stepover apart round the bar, some of them close to its edges."""
    levels = (-0.027, -0.009, 0.009, 0.027)
    faces = [along(side * THIN / 2, y, (side, 0, 0)) for side in (-1.0, 1.0) for y in levels]
    return faces + [along(0.0, side * WIDE / 2, (0, side, 0)) for side in (-1.0, 1.0)]


def test_a_place_next_to_an_edge_is_on_the_face_of_its_tool():
    up, right = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    points = np.array([[-0.01, 0.0, 0.0], [0.001, 0.0, -0.004]])
    tangents = np.array([[right, [0.0, 1.0, 0.0]], [[0.0, 1.0, 0.0], up]])
    uv = np.array([[0.0, 0.0], [1.0, 1.0]])
    patch = Patch(np.arange(2), points, uv, tangents, np.zeros(2, int), 0.01)
    place = np.zeros((1, 3))
    for tail, point, where in ((up, 0, [0.01, 0.0]), (right, 1, [1.0, 1.004])):
        _, next_to, found = _placed(patch, place, tail[None], np.ones(2, bool))
        assert next_to[0] == point
        np.testing.assert_allclose(found, [where])


def test_a_line_that_is_missing_on_a_bar_is_missed():
    surface = bar()
    patches = patches_of(surface, np.arange(len(surface.points)))
    lines = [line for k, line in enumerate(round_the_bar()) if k not in (1, 2)]
    found = line_spacing(patches, sample_lines(lines, 0.025, STEPOVER), STEPOVER)
    assert found.distance.max() > 1.5 * STEPOVER


def test_a_line_that_faces_no_patch_is_beside_none():
    surface = bar()
    patches = patches_of(surface, np.flatnonzero(surface.normals[:, 0] > 0.5))
    upright = [along(THIN / 2, y, (1, 0, 0)) for y in (-0.02, 0.02)]
    astray = [*upright, along(THIN / 2, 0.0, (-1, 0, 0))]
    for lines in (upright, astray):
        found = line_spacing(patches, sample_lines(lines, 0.025, STEPOVER), STEPOVER)
        np.testing.assert_allclose(found.distance, 0.04, atol=2e-3)
