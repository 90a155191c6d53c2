"""Free moves to lines and away from them."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import straight
from nrdf.geometry.polylines import longest_step
from nrdf.toolpath.modifiers.approach_retract import FreeMove, approach_retract
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.tool_segments import tool_segments

STRAIGHT = FreeMove(0.05, 0.0, 0.25)


def line():
    path = straight((0, 0, 0), (0.1, 0, 0))
    return tool_segments([path.contacts], [path.normals], Strategy()), [path.normals]


def test_straight_moves_follow_distance_angle_and_feed():
    lines, normals = line()
    aslant = FreeMove(0.04, np.radians(30.0), 0.1)
    approach, work, retract = approach_retract(lines, normals, STRAIGHT, aslant, 0.01)
    assert work is lines[0]
    assert approach.positions == pytest.approx(np.array([[0, 0, 0.05], [0, 0, 0]]))
    assert retract.positions[-1] == pytest.approx([0.1 + 0.02, 0, 0.04 * np.cos(np.pi / 6)])
    assert (approach.kind, approach.feed_m_s, retract.feed_m_s) == ("approach", 0.25, 0.1)
    np.testing.assert_array_equal(approach.quaternions_xyzw[0], work.quaternions_xyzw[0])


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 3])
def test_an_arc_turns_the_way_into_the_line_without_a_kink(angle):
    lines, normals = line()
    move = FreeMove(0.05, angle, 0.25, radius_m=0.02)
    approach, work, retract = approach_retract(lines, normals, move, move, 0.005)
    way = np.concatenate([approach.positions, work.positions[1:2]])
    steps = np.diff(way, axis=0)
    ahead = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    turns = np.arccos(np.clip((ahead[1:] * ahead[:-1]).sum(axis=1), -1.0, 1.0))
    assert turns.max() < np.radians(16.0)
    # All of the arc is one radius from its centre, above the line's start.
    assert np.linalg.norm(way[1:-1] - [0, 0, 0.02], axis=1) == pytest.approx(0.02)
    assert way[-2] == pytest.approx([0, 0, 0]) and way[:-2, 2].min() > 0.0
    assert longest_step(way[1:]) < 0.0101
    assert retract.positions[:, 0] == pytest.approx(0.1 - approach.positions[::-1, 0])


def test_moves_of_no_length_are_left_out():
    lines, normals = line()
    none = FreeMove(0.0, 0.0, 0.1)
    assert approach_retract(lines, normals, none, none, 0.01) == lines
    (arc, _) = approach_retract(lines, normals, FreeMove(0.0, 0.0, 0.1, 0.02), none, 0.01)
    assert arc.positions[0] == pytest.approx([-0.02, 0, 0.02])
