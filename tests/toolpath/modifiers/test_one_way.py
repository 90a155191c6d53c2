"""Which way paths are driven, and where the first begins."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from builders.surface_paths import UP, rows
from nrdf.toolpath.modifiers import one_way, start_at
from nrdf.toolpath.surface_path import SurfacePath

AHEAD = np.array([1.0, 0.0, 0.0])


def snake(places):
    return [p.reversed() if k % 2 else p for k, p in enumerate(rows(places))]


def ring(sense: float) -> SurfacePath:
    angles = sense * np.linspace(0.0, 2.0 * np.pi, 41)
    places = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    return SurfacePath(places, np.tile(UP, (41, 1)), True)


def test_every_line_is_driven_along_the_direction():
    for sign in (1.0, -1.0):
        made = one_way(snake([0.0, 0.02, 0.04]), sign * AHEAD)
        assert [np.sign(p.contacts[-1, 0] - p.contacts[0, 0]) for p in made] == [sign] * 3
        assert [p.contacts[0, 1] for p in made] == [0.0, 0.02, 0.04]


def test_rings_run_against_the_clock():
    for made in one_way([ring(1.0), ring(-1.0)], AHEAD):
        assert np.cross(made.contacts[0], made.contacts[1])[2] > 0


@pytest.mark.parametrize(
    ("towards", "first"),
    [
        ((-1, -1, 0), (0, 0, 0)),
        ((-1, 1, 0), (0, 0.04, 0)),
        ((1, -1, 0), (0.2, 0, 0)),
        ((1, 1, 0), (0.2, 0.04, 0)),
    ],
)
def test_the_first_line_begins_in_the_corner_and_neighbours_stay(towards, first):
    made = start_at(snake([0.0, 0.02, 0.04]), np.array(towards))
    assert made[0].contacts[0] == pytest.approx(first)
    for one, other in itertools.pairwise(made):
        assert np.linalg.norm(one.contacts[-1] - other.contacts[0]) == pytest.approx(0.02)


def test_lines_of_one_direction_only_change_their_order():
    given = rows([0.0, 0.02, 0.04])
    made = start_at(given, np.array([1.0, 1.0, 0.0]), may_turn=False)
    assert made[0].contacts[0] == pytest.approx([0, 0.04, 0])
    assert start_at([], AHEAD) == []
