"""Lines where others leave something out."""

from __future__ import annotations

import numpy as np

from builders.surfaces import board, tube
from nrdf.surface.patch import patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.gap_filling import fill_missed_points, fill_wide_gaps
from nrdf.toolpath.sampled_path import line_spacing, sample_lines
from nrdf.toolpath.surface_path import SurfacePath

SURFACE = Surface(*board(spacing=0.008))
ALL = np.arange(len(SURFACE.points))
SPACING, RADIUS = 0.01, 0.025


def line(y: float, first: float = 0.02, last: float = 0.38) -> SurfacePath:
    """A line along x on the board of 0.4 by 0.3 m."""
    x = np.arange(first, last, SPACING)
    contacts = np.stack([x, np.full_like(x, y), np.zeros_like(x)], axis=1)
    return SurfacePath(contacts, np.tile([0.0, 0.0, 1.0], (len(x), 1)))


def spread(*levels: float) -> list[SurfacePath]:
    return [line(y) for y in levels]


def test_points_next_to_a_line_that_it_misses_get_one_of_their_own():
    lines = spread(0.02, 0.06, 0.1, 0.2, 0.24, 0.28)  # a stripe between 0.125 and 0.175 is left
    wanted = np.flatnonzero((SURFACE.points[:, 0] > 0.02) & (SURFACE.points[:, 0] < 0.38))
    made = fill_missed_points(SURFACE, wanted, lines, SPACING, RADIUS, 0.04)
    assert made
    reached = sample_lines([*lines, *made], RADIUS, 0.04).coverage_count(
        SURFACE.points[wanted], SURFACE.normals[wanted], RADIUS
    )
    assert (reached > 0).all()
    new = np.concatenate([extra.contacts for extra in made])
    assert ((new[:, 1] > 0.12) & (new[:, 1] < 0.18)).all()


def test_stripes_that_are_asked_for_and_points_far_off_stay():
    wide = spread(0.04, 0.15, 0.26)
    inside = np.flatnonzero(np.abs(SURFACE.points[:, 0] - 0.2) < 0.1)
    assert fill_missed_points(SURFACE, inside, wide, SPACING, RADIUS, 0.11) == []
    far = np.flatnonzero(SURFACE.points[:, 1] > 0.2)
    assert fill_missed_points(SURFACE, far, spread(0.02), SPACING, RADIUS, 0.04) == []


def test_with_a_tool_smaller_than_the_points_spacing_that_counts():
    radius = 0.004
    beside = np.flatnonzero(
        (np.abs(SURFACE.points[:, 1] - 0.1) < 0.003) & (np.abs(SURFACE.points[:, 0] - 0.2) < 0.1)
    )
    lines = spread(0.1 - 5.0 * radius)
    made = fill_missed_points(SURFACE, beside, lines, SPACING, radius, 0.006)
    reached = sample_lines(made, radius, 0.006).coverage_count(
        SURFACE.points[beside], SURFACE.normals[beside], radius
    )
    assert (reached > 0).all()


def test_a_break_in_a_line_is_filled():
    patches = patches_of(SURFACE, ALL)
    whole = spread(0.07, 0.11, 0.19, 0.23)
    broken = [line(0.15, 0.02, 0.14), line(0.15, 0.26, 0.38)]
    lines = [*whole, *broken]
    before = line_spacing(patches, sample_lines(lines, RADIUS, 0.04), 0.04).distance
    assert before.max() > 0.079
    made = fill_wide_gaps(SURFACE, patches, lines, SPACING, RADIUS, 0.04)
    new = np.concatenate([extra.contacts for extra in made])
    np.testing.assert_allclose(new[:, 1], 0.15, atol=1e-3)
    assert new[:, 0].min() < 0.18 and new[:, 0].max() > 0.22
    after = line_spacing(patches, sample_lines([*lines, *made], RADIUS, 0.04), 0.04).distance
    assert after.max() < 1.15 * 0.04


def test_lines_that_are_close_enough_are_left_as_they_are():
    patches = patches_of(SURFACE, ALL)
    assert fill_wide_gaps(SURFACE, patches, spread(0.1, 0.14, 0.18), SPACING, RADIUS, 0.04) == []
    assert fill_wide_gaps(SURFACE, patches, [], SPACING, RADIUS, 0.04) == []


def test_what_is_past_a_lines_end_is_no_neighbour():
    patches = patches_of(SURFACE, ALL)
    aslant = [line(0.1, 0.02, 0.2), line(0.14, 0.24, 0.38)]
    assert not len(line_spacing(patches, sample_lines(aslant, RADIUS, 0.04), 0.04).distance)


def test_a_face_a_little_off_is_worked_but_single_points_are_not():
    near = np.flatnonzero(np.abs(SURFACE.points - [0.2, 0.1, 0.0]).max(axis=1) < 0.006)
    assert len(near) >= 3
    assert fill_missed_points(SURFACE, near, spread(0.02), SPACING, RADIUS, 0.04)
    assert fill_missed_points(SURFACE, near[:1], spread(0.02), SPACING, RADIUS, 0.04) == []


def test_a_gap_round_a_bend_is_filled_on_the_surface():
    surface = Surface(*tube(radius=0.08, length=0.3, turn=2.0))
    patches = patches_of(surface, np.arange(len(surface.points)))
    z = np.arange(0.03, 0.27, SPACING)
    lines = []
    for angle in (-0.35, 0.35):
        normal = np.array([np.cos(angle), np.sin(angle), 0.0])
        contacts = 0.08 * normal + np.c_[np.zeros((len(z), 2)), z]
        lines.append(SurfacePath(contacts, np.tile(normal, (len(z), 1))))
    made = fill_wide_gaps(surface, patches, lines, SPACING, RADIUS, 0.03)
    assert len(made) == 1
    np.testing.assert_allclose(np.linalg.norm(made[0].contacts[:, :2], axis=1), 0.08, atol=1e-3)
    np.testing.assert_allclose(made[0].contacts[:, 1], 0.0, atol=2e-3)
