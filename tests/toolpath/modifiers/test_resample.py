"""Fewer points within a chord error and a turn."""

from __future__ import annotations

import numpy as np

from builders.surface_paths import over_an_edge, straight
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.modifiers.resample import resample
from nrdf.toolpath.surface_path import SurfacePath


def arc(radius=0.1, count=201):
    angle = np.linspace(0, np.pi / 2, count)
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    return SurfacePath(radius * outward, outward)


def test_a_straight_way_keeps_its_ends():
    (made,) = resample([straight((0, 0, 0), (0.2, 0, 0))], 1e-6, 0.1)
    assert made.contacts.tolist() == [[0, 0, 0], [0.2, 0, 0]]
    (made,) = resample([straight((0, 0, 0), (0.2, 0, 0))], 1e-6, 0.1, 0.0501)
    assert len(made.contacts) == 5


def test_an_arc_keeps_what_its_chord_error_asks_for():
    (made,) = resample([arc()], 1e-4, 10.0)
    half = 0.5 * step_lengths(made.contacts)
    sag = 0.1 - np.sqrt(0.1**2 - half**2)
    assert sag.max() <= 1e-4 and len(made.contacts) < 25
    assert np.median(sag) > 0.7e-4  # no more points than are needed


def test_turns_are_limited_too():
    (made,) = resample([arc()], 1.0, 0.2)
    turned = np.arccos(np.clip((made.normals[1:] * made.normals[:-1]).sum(axis=1), -1, 1))
    assert turned.max() <= 0.2 + 1e-9 and len(made.contacts) == 9
    (edge,) = resample([over_an_edge(1.0)], 1e-6, 0.1)
    assert edge.contacts[:, 0].round(3).tolist() == [0.0, 0.1, 0.11, 0.2]
