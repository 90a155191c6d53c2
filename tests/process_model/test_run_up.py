"""Lines that begin and end at rest beside their region."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.process_model.moves import Moves
from nrdf.process_model.run_up import rooms_for, with_run_up
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.types import Segment, split_at_edges


def a_line(standoff=0.15):
    x = np.linspace(0.0, 0.2, 21)
    places = np.stack([x, 0.0 * x, 0.0 * x + standoff], axis=1)
    down = np.tile([1.0, 0.0, 0.0, 0.0], (21, 1))
    line = Segment("process", 0, places, down, 0.3, feeds_m_s=np.full(21, 0.3))
    free = np.array([[0.0, 0.0, 0.05], [0.0, 0.0, 0.0]])
    approach = Segment("approach", 0, places[0] + free, down[:2], 0.5)
    return [approach, line, Segment("retract", 0, places[-1] + free[::-1], down[:2], 0.5)]


def a_floor(wall_x):
    """The plane z = 0, with a wall at x = wall_x."""
    floor = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]
    wall = [(wall_x, -2, 0), (wall_x, 2, 0), (wall_x, 2, 2), (wall_x, -2, 2)]
    faces = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    return TargetMesh(np.array([*floor, *wall], float), np.array(faces))


def test_a_wall_leaves_less_room():
    rooms = rooms_for(a_line(), a_floor(0.36), 0.15)
    assert rooms.shape == (1, 2)
    assert rooms[0, 0] == pytest.approx(0.15)  # as far as is looked
    assert rooms[0, 1] == pytest.approx(0.16 - 0.6 * 0.15, abs=0.0101)


def test_a_line_passes_its_ends_at_speed_with_the_gun_off_before():
    before = a_line()
    made = with_run_up(before, np.array([[0.1, 0.02]]), 2.0)
    line = made[1]
    start, stop = np.flatnonzero(line.applies)[[0, -1]]
    np.testing.assert_array_equal(line.positions[start : stop + 1], before[1].positions)
    assert line.positions[start, 0] - line.positions[0, 0] >= 0.3**2 / (2.0 * 2.0)
    assert line.positions[-1, 0] - line.positions[stop, 0] == pytest.approx(0.02)
    assert (line.speeds_m_s == 0.3).all() and not line.over_surface[[0, -1]].any()
    assert made[0].positions[-1] == pytest.approx(line.positions[0])
    assert made[2].positions[0] == pytest.approx(line.positions[-1])
    same = Moves.of(made, 0.01)  # nothing is laid where the gun is off
    assert same.lengths_m == pytest.approx(Moves.of(before, 0.01).lengths_m)


def test_programs_switch_the_gun_where_the_line_begins():
    line = with_run_up(a_line(), np.array([[0.1, 0.1]]), 2.0)[1]
    parts = split_at_edges(line)
    assert [part.kind for part in parts] == ["approach", "process", "retract"]
    np.testing.assert_allclose(parts[0].positions[-1], parts[1].positions[0])
    assert all(part.tool_on is None for part in parts)
    assert split_at_edges(replace(line, tool_on=None, on_surface=None))[0].kind == "process"
