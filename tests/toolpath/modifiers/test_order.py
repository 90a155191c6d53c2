"""The order of paths."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import UP, rows, straight
from nrdf.toolpath.modifiers.order import Lift, order_nearest, order_shortest, way_between

PLACES = np.arange(6) * 0.02


def test_rows_become_a_snake():
    ordered = order_nearest(rows(PLACES))
    assert [path.contacts[0, 1] for path in ordered] == pytest.approx(PLACES)
    assert [path.contacts[0, 0] for path in ordered] == pytest.approx([0, 0.2] * 3)
    assert way_between(ordered) == pytest.approx(5 * 0.02)


def test_every_path_is_driven_once_the_nearest_next():
    mixed = rows(PLACES[[0, 3, 1, 5, 2, 4]])
    ordered = order_nearest(mixed)
    assert [path.contacts[0, 1] for path in ordered] == pytest.approx(PLACES)
    one_way = order_nearest(mixed, one_way=True)
    assert [path.contacts[0, 0] for path in one_way] == pytest.approx([0.0] * 6)
    assert {id(path) for path in one_way} == {id(path) for path in mixed}


def test_a_shorter_order_than_the_nearest_next_is_kept():
    # The nearest next is always farther up, until the one below is left for last.
    given = rows([0.0, -0.011, 0.01, 0.03, 0.07], length=0.001)
    nearest = order_nearest(given, one_way=True)
    assert [path.contacts[0, 1] for path in nearest] == [0.0, 0.01, 0.03, 0.07, -0.011]
    assert way_between(order_shortest(given, one_way=True)) <= way_between(given)
    assert way_between(given) < way_between(nearest)
    assert order_nearest(given[:2]) == given[:2]
    assert order_nearest([]) == []


def test_turning_runs_around_shortens_what_the_nearest_next_leaves_for_last():
    rng = np.random.default_rng(3)
    starts = np.pad(rng.uniform(0, 1, (40, 2)), ((0, 0), (0, 1)))
    given = [straight(p, p + np.array([0.05, 0.0, 0.0])) for p in starts]
    nearest, shortest = order_nearest(given), order_shortest(given)
    assert way_between(shortest) < 0.9 * way_between(nearest)
    assert shortest[0] is given[0]
    middles = {tuple(np.round(path.contacts.mean(axis=0), 9)) for path in shortest}
    assert middles == {tuple(np.round(path.contacts.mean(axis=0), 9)) for path in given}
    # No run that could still be turned around would make it shorter.
    for i in range(1, len(given)):
        for j in range(i + 1, len(given) + 1):
            turned = [path.reversed() for path in shortest[i:j][::-1]]
            other = [*shortest[:i], *turned, *shortest[j:]]
            assert way_between(other) > way_between(shortest) - 1e-5


def test_where_lifting_counts_the_next_line_on_the_same_side_comes_before_a_nearer_one_behind():
    top = rows([0.0, 0.03])
    behind = straight((0.2, 0.01, -0.005), (0.0, 0.01, -0.005), normal=-UP)
    assert order_nearest([top[0], behind, top[1]])[1] is behind
    made = order_shortest([top[0], behind, top[1]], lift=Lift(0.05, 0.05))
    assert made[1].contacts[0] == pytest.approx([0.2, 0.03, 0.0])
    far = Lift(0.05, 0.02)
    assert way_between([top[0], top[1]], far) == pytest.approx(0.1 + np.hypot(0.2, 0.03))
    assert way_between([top[0], top[1].reversed()], Lift(0.05, 0.05)) == pytest.approx(0.03)
    thin = [top[0], straight((0.2, 0, -0.005), (0, 0, -0.005), normal=-UP)]
    assert way_between(thin, Lift(0.05)) == pytest.approx(0.105 + 0.1)


def test_the_two_sides_of_a_thin_sheet_are_driven_one_after_the_other():
    def side(height, up):
        return [
            straight((0.0, y, height), (0.5, y, height), normal=up * UP) for y in (0.0, 0.02, 0.04)
        ]

    found = order_shortest([*side(0.005, 1.0), *side(0.0, -1.0)], lift=Lift(0.05))
    assert [float(path.normals[0, 2]) for path in found] == [1.0] * 3 + [-1.0] * 3


def test_lines_of_one_way_are_never_turned():
    given = rows(PLACES[[0, 3, 1, 5, 2, 4]])
    assert {id(path) for path in order_shortest(given, one_way=True)} == {id(p) for p in given}
    assert order_shortest(given[:1]) == given[:1]
