"""Paths joined on the surface."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import UP, rows, straight
from nrdf.geometry.polylines import longest_step
from nrdf.toolpath.modifiers.join import join
from nrdf.toolpath.modifiers.split import turns

SPACING, GAP = 0.01, 0.05


def plane(places, normals):
    flat = places * [1.0, 1.0, 0.0]
    return flat, np.tile(UP, (len(places), 1)), np.ones(len(places), bool)


def test_rows_become_one_zigzag():
    given = rows(np.arange(5) * 0.025)
    (made,) = join(given, plane, SPACING, GAP)
    assert longest_step(made.contacts) <= SPACING * 1.01
    assert made.contacts[0] == pytest.approx([0, 0, 0])
    assert made.contacts[-1] == pytest.approx([0.2, 0.1, 0])
    assert len(made.contacts) == 5 * 21 + 4 * 2
    assert len(given) == 5 and len(given[0].contacts) == 21


def test_what_is_far_or_on_another_side_stays_apart():
    far = [straight((0, 0, 0), (0.1, 0, 0)), straight((0.2, 0, 0), (0.3, 0, 0))]
    assert len(join(far, plane, SPACING, GAP)) == 2
    below = [
        straight((0, 0, 0), (0.1, 0, 0)),
        straight((0, 0, -0.01), (0.1, 0, -0.01), normal=-UP),
    ]
    assert len(join(below, plane, SPACING, GAP)) == 2


def test_no_way_leads_over_a_hole_or_a_step():
    given = rows([0.0, 0.04])

    def hole(places, normals):
        flat, outward, there = plane(places, normals)
        return flat, outward, there & (np.abs(flat[:, 1] - 0.02) > 0.005)

    def step(places, normals):
        flat, outward, there = plane(places, normals)
        return flat - 0.05 * UP, outward, there

    assert len(join(given, hole, SPACING, GAP)) == 2
    assert len(join(given, step, SPACING, GAP)) == 2


def test_points_between_lie_on_the_surface():
    radius = 0.1

    def cylinder(places, normals):
        outward = places * [0.0, 1.0, 1.0]
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        return places * [1.0, 0.0, 0.0] + radius * outward, outward, np.ones(len(places), bool)

    around = [np.array([0.0, np.sin(a), np.cos(a)]) for a in (0.0, 0.3)]
    given = [straight(radius * n, radius * n + [0.2, 0, 0], normal=n) for n in around]
    (made,) = join(given, cylinder, 0.005, GAP)
    assert np.linalg.norm(made.contacts[:, 1:], axis=1) == pytest.approx(radius)
    assert turns(made.normals).max() < 0.06


def test_all_ways_are_projected_at_once():
    calls = []

    def counted(places, normals):
        calls.append(len(places))
        return plane(places, normals)

    assert len(join(rows(np.arange(30) * 0.025), counted, SPACING, GAP)) == 1
    assert calls == [29 * 2]


def test_a_way_along_an_edge_keeps_to_its_side():
    def edge(places, normals):
        flat, _outward, there = plane(places, normals)
        return flat, np.tile([1.0, 0.0, 0.0], (len(places), 1)), there

    (made,) = join(rows([0.0, 0.025]), edge, SPACING, GAP)
    assert turns(made.normals).max() < 1e-6
