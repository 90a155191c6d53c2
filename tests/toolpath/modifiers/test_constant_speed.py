"""Feeds of the contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.surface_paths import straight
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.toolpath.modifiers import constant_speed
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.tool_segments import contact_points, tool_segments

STRATEGY = Strategy(standoff_m=0.2, feed_m_s=0.1)


def around(radius: float, outward: float) -> SurfacePath:
    angles = np.linspace(0.0, 1.0, 101)
    out = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    return SurfacePath(radius * out, outward * out)


@pytest.mark.parametrize(("radius", "outward"), [(0.4, 1.0), (0.4, -1.0), (0.2, 1.0)])
def test_the_contact_moves_at_the_feed_around_bends(radius, outward):
    path = around(radius, outward)
    lines = tool_segments([path.contacts], [path.normals], STRATEGY)
    (made,) = constant_speed(lines, [contact_points(line, STRATEGY) for line in lines])
    time = total_length(made.positions) / made.feed_m_s
    assert total_length(path.contacts) / time == pytest.approx(0.1)
    assert made.feed_m_s == pytest.approx(0.1 * (radius + outward * 0.2) / radius, rel=1e-3)
    assert made.feeds_m_s is None  # one bend, one feed


def test_a_straight_line_and_a_single_waypoint_keep_their_feed():
    path = straight((0, 0, 0), (0.2, 0, 0))
    (line,) = tool_segments([path.contacts], [path.normals], STRATEGY)
    (made,) = constant_speed([line], [path.contacts])
    assert made.feed_m_s == pytest.approx(0.1)
    alone = replace(line, positions=line.positions[:1])
    assert constant_speed([alone], [path.contacts[:1]])[0].feed_m_s == 0.1


def test_within_a_line_every_stretch_has_its_own_feed():
    bend = around(0.4, 1.0)
    flat = bend.contacts[0] - np.outer(np.linspace(0.3, 0.005, 60), [1.0, 0.0, 0.0])
    contacts = np.concatenate([flat, bend.contacts])
    normals = np.concatenate([np.tile(bend.normals[0], (60, 1)), bend.normals])
    lines = tool_segments([contacts], [normals], STRATEGY)
    (made,) = constant_speed(lines, [contacts])
    assert made.feeds_m_s[1:60] == pytest.approx(0.1)
    assert made.feeds_m_s[61:] == pytest.approx(0.15, rel=1e-3)
    assert step_lengths(contacts) * made.feeds_m_s[1:] / step_lengths(
        made.positions
    ) == pytest.approx(0.1)
    assert made.seconds == pytest.approx(total_length(contacts) / 0.1)
    assert made.seconds == pytest.approx(total_length(made.positions) / made.feed_m_s)


def test_no_tool_is_driven_without_limit():
    path = around(0.02, 1.0)
    lines = tool_segments([path.contacts], [path.normals], STRATEGY)
    (made,) = constant_speed(lines, [path.contacts])
    assert made.feed_m_s == pytest.approx(0.3)
