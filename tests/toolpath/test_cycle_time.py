from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from nrdf.geometry.mesh import Mesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.cycle_time import ArmTimes, estimate_cycle_time, free_sides
from nrdf.toolpath.types import Segment

UP = np.array([0.0, 0.0, 1.0])
DOWN = Rotation.from_euler("x", np.pi)
TIMES = ArmTimes(turn_rad_s=0.5, transition_s=4.0, turntable_s=3.0, lifts_per_m=0.0)
FEED = 0.1


def solid(*bounds) -> TargetMesh:
    parts = [trimesh.creation.box(bounds=some) for some in bounds]
    mesh = trimesh.util.concatenate(parts)
    return TargetMesh.from_mesh(Mesh(np.array(mesh.vertices), np.array(mesh.faces)))


BOARD = ((-0.5, -0.1, -0.02), (0.5, 0.1, 0.0))


def line(start, stop, turn=DOWN, count=41) -> Segment:
    share = np.linspace(0.0, 1.0, count)[:, None]
    positions = (1.0 - share) * np.array(start, float) + share * np.array(stop, float)
    return Segment("process", 0, positions, np.tile(turn.as_quat(), (count, 1)), FEED, 10.0)


def time_of(segments, surface, times=TIMES):
    return estimate_cycle_time(segments, surface, 0.02, UP, times)


def test_a_free_line_takes_its_feed_and_one_way_there_and_one_back():
    found = time_of([line((-0.4, 0, 0), (0.4, 0, 0))], solid(BOARD))
    assert found.process_s == pytest.approx(0.8 / FEED)
    assert found.strokes == 1 and found.reachable == 1.0
    assert found.transition_s == pytest.approx(8.0) and found.turntable_s == 0.0
    assert found.total_s == pytest.approx(16.0)
    slow = replace(line((-0.4, 0, 0), (0.4, 0, 0)), dwell_s=2.0)
    assert time_of([slow], solid(BOARD)).total_s == pytest.approx(18.0)


def test_approaches_and_retracts_are_driven_at_their_own_feeds():
    work = line((-0.4, 0, 0), (0.4, 0, 0))
    down = replace(line((-0.4, 0, 0.1), (-0.4, 0, 0)), kind="approach", feed_m_s=0.2)
    away = replace(line((0.4, 0, 0), (0.4, 0, 0.1)), kind="retract", feed_m_s=0.4)
    found = time_of([down, work, away], solid(BOARD))
    assert found.approach_retract_s == pytest.approx(0.1 / 0.2 + 0.1 / 0.4)


def test_where_the_axis_turns_the_arm_is_slower_than_the_feed():
    work = line((-0.01, 0, 0), (0.01, 0, 0), count=5)
    turns = DOWN * Rotation.from_euler("y", np.linspace(-0.5, 0.5, 5)[:, None])
    work = replace(work, quaternions_xyzw=turns.as_quat())
    assert time_of([work], solid(BOARD)).process_s == pytest.approx(1.0 / 0.5, rel=0.01)


def test_the_tool_lifts_where_something_stands_in_its_way_and_what_it_cannot_reach_takes_no_time():
    wall = ((-0.01, -0.1, 0.0), (0.01, 0.1, 0.3))
    found = time_of([line((-0.4, 0, 0), (0.4, 0, 0))], solid(BOARD, wall))
    assert found.strokes == 2
    assert 0.85 < found.reachable < 0.99
    assert found.process_s == pytest.approx(found.reachable * 0.8 / FEED, rel=0.05)


def test_the_object_turns_for_its_other_sides():
    block = solid(((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3)))
    sides = []
    for angle in np.arange(4) * np.pi / 2:
        round_ = Rotation.from_euler("z", angle)
        ends = round_.apply([(0.3, -0.2, 0), (0.3, 0.2, 0)])
        sides.append(line(*ends, round_ * Rotation.from_euler("y", -np.pi / 2)))
    assert time_of(sides[:1], block).turntable_s == 0.0
    every = time_of(sides, block)
    assert every.strokes == 4 and every.turntable_s in (3.0, 6.0, 9.0)
    assert every.transition_s == pytest.approx(4.0 * (4 + 1) + 4.0 / 3.0 * every.turntable_s)


def test_long_ways_are_lifted_from_more_often():
    more = replace(TIMES, lifts_per_m=0.5)
    segments = [line((-0.4, 0, 0), (0.4, 0, 0))]
    assert time_of(segments, solid(BOARD), more).strokes == pytest.approx(1.4)


def test_beside_a_wall_the_shaft_points_away_from_it():
    wall = ((0.05, -0.1, 0.0), (0.07, 0.1, 0.5))
    place, axis = np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, -1.0]])
    free, shafts = free_sides(solid(BOARD, wall), place, axis, 0.02)
    towards = shafts[0, :, 0]
    assert not free[0, towards > 0.5].any() and free[0, towards < -0.5].all()
