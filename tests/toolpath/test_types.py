from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.geometry.similarity import Similarity
from nrdf.toolpath.types import Job, Segment, ToolPath, split_at_edges


def segment(kind, line=0, count=3):
    positions = np.arange(3.0 * count).reshape(count, 3)
    return Segment(kind, line, positions, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), 0.1)


def test_waypoints_are_the_poses_of_a_segment_in_order():
    quaternions = np.eye(4)[:3]
    made = Segment("process", 0, np.arange(9.0).reshape(3, 3), quaternions, 0.1).waypoints
    assert [w.position_m.tolist() for w in made] == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert [w.quaternion_xyzw.tolist() for w in made] == quaternions.tolist()


def test_axes_are_tool_z():
    half = np.sqrt(0.5)
    turned = np.array([[half, 0.0, 0.0, half], [0.0, 0.0, 0.0, 1.0]])  # about x, and not at all
    made = Segment("process", 0, np.zeros((2, 3)), turned, 0.1)
    np.testing.assert_allclose(made.axes, [[0, -1, 0], [0, 0, 1]], atol=1e-12)


def test_a_segment_is_driven_at_one_feed_or_at_one_for_each_waypoint():
    line = segment("process")
    step = np.sqrt(27.0)
    assert line.speeds_m_s.tolist() == [0.1] * 3
    np.testing.assert_allclose(line.seconds, 2 * step / 0.1)
    own = replace(line, feeds_m_s=np.array([9.0, 0.2, 0.4]))
    np.testing.assert_allclose(own.seconds, step / 0.2 + step / 0.4)


def test_groups_are_process_segments_with_the_moves_beside_them():
    kinds = ("approach", "process", "retract", "transition", "approach", "process", "process")
    segments = tuple(segment(kind, line) for line, kind in enumerate(kinds))
    path = ToolPath("seat", "sand", "disc", 0.02, segments)
    found = [
        [None if s is None else s.line for s in (group.approach, group.process, group.retract)]
        for group in path.groups
    ]
    assert found == [[0, 1, 2], [4, 5, None], [None, 6, None]]
    assert ToolPath("seat", "sand", "disc", 0.02, ()).groups == ()


def test_up_and_forward_are_the_pose_s_axes():
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    job = Job("chair", "cell", (), Similarity(turn, np.zeros(3), 1.0))
    assert job.up.tolist() == turn[:, 1].tolist()
    assert job.forward.tolist() == turn[:, 0].tolist()


def test_a_stroke_that_leaves_the_surface_is_split_where_it_does_and_has_no_force_there():
    over = np.array([False, True, True, False, False, True])
    line = replace(segment("process", count=6), force_n=9.0, dwell_s=2.0, on_surface=over)
    parts = split_at_edges(line)
    assert [p.force_n for p in parts] == [None, 9.0, None, 9.0]
    assert [len(p.positions) for p in parts] == [2, 2, 3, 1]
    assert [p.dwell_s for p in parts] == [0.0, 0.0, 0.0, 2.0]
    # Force begins where the tool is back on the surface, and ends where it leaves it.
    assert parts[0].positions[-1].tolist() == parts[1].positions[0].tolist()
    assert parts[1].positions[-1].tolist() == line.positions[2].tolist()
    assert [p.over_surface.any() for p in parts] == [False, True, False, True]
    for whole in (segment("process"), segment("approach")):
        assert split_at_edges(whole) == [whole]
    assert segment("process").over_surface.all() and not segment("approach").over_surface.any()
