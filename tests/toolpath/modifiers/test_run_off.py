"""Paths that go on beyond their ends."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import UP, straight
from nrdf.geometry.polylines import longest_step, total_length
from nrdf.toolpath.modifiers import run_off
from nrdf.toolpath.surface_path import SurfacePath

SPACING = 0.01


def test_both_ends_go_straight_on_and_rise_without_a_kink():
    (given,) = paths = [straight((0, 0, 0), (0.2, 0, 0))]
    (made,) = run_off(paths, 0.05, SPACING, height_m=0.02)
    assert made.contacts[0] == pytest.approx([-0.05, 0, 0.02])
    assert made.contacts[-1] == pytest.approx([0.25, 0, 0.02])
    assert made.contacts[5:-5] == pytest.approx(given.contacts)
    slope = np.diff(made.contacts[-6:, 2]) / SPACING
    assert slope[0] < 0.1 and (np.diff(slope) > 0).all()
    assert longest_step(made.contacts) < 1.3 * SPACING


def test_the_run_off_follows_the_bend_and_its_normals_stay_square_to_it():
    radius, angles = 0.3, np.linspace(0.0, 1.0, 31)
    out = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    (made,) = run_off([SurfacePath(radius * out, out)], 0.05, SPACING)
    away = np.linalg.norm(made.contacts, axis=1)
    assert away == pytest.approx(radius, abs=2e-4)
    assert np.einsum("na,na->n", made.normals, made.contacts / away[:, None]).min() > 0.9999
    inward = SurfacePath(radius * out, -out)
    (made,) = run_off([inward], 0.05, SPACING)
    assert np.linalg.norm(made.contacts, axis=1) == pytest.approx(radius, abs=2e-4)


def test_it_ends_before_what_is_in_the_way():
    def free(places, travel, normals):
        assert travel[:, 0] == pytest.approx(np.sign(places[:, 0] - 0.1))
        assert normals == pytest.approx(np.tile(UP, (len(places), 1)))
        return places[:, 0] < 0.225

    (made,) = run_off([straight((0, 0, 0), (0.2, 0, 0))], 0.05, SPACING, free=free)
    assert made.contacts[-1, 0] == pytest.approx(0.22)
    assert made.contacts[0, 0] == pytest.approx(-0.05)


def test_rings_and_a_length_of_zero_change_nothing():
    angles = np.linspace(0.0, 2.0 * np.pi, 41)
    ring = SurfacePath(
        np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1), np.tile(UP, (41, 1)), True
    )
    line = straight((0, 0, 0), (0.2, 0, 0))
    assert run_off([ring], 0.05, SPACING)[0] is ring
    assert run_off([line], 0.0, SPACING)[0] is line
    (short,) = run_off([straight((0, 0, 0), (0.01, 0, 0))], 0.05, SPACING)
    assert total_length(short.contacts) == pytest.approx(0.11)
