from __future__ import annotations

import numpy as np
import pytest

from nrdf.robot.planning.path_tracking import advance, advance_free, advance_tilted, tilted_axes


@pytest.fixture(scope="module")
def start(wall_paths):
    """The joint path of the line's beginning."""
    return next(path for path in wall_paths[0] if path.first == 0)


def test_axes_are_tilted_by_the_angle_to_every_side():
    axes = np.array([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0]])
    tilted = tilted_axes(axes, 0.1, 6)
    assert tilted.shape == (2, 6, 3)
    np.testing.assert_allclose(np.einsum("bka,ba->bk", tilted, axes), np.cos(0.1), atol=1e-12)
    np.testing.assert_allclose(tilted.mean(axis=1), np.cos(0.1) * axes, atol=1e-12)


def test_the_next_waypoint_is_reached_and_a_far_one_is_not(wall, start):
    process, cell = wall.path.segments[0], wall.cell
    index, joints = np.array([start.turntable_index]), start.joints[:1]
    moved, good = advance(cell, index, joints, joints, process.positions[1:2], process.axes[1:2])
    assert good.all()
    at, _ = cell.to_base(index, process.positions[1:2], process.axes[1:2])
    np.testing.assert_allclose(cell.chain.frames(moved).tcp, at, atol=1e-4)
    far = process.positions[:1] + np.array([-0.5, 0.3, 0.5])
    assert not advance(cell, index, joints, joints, far, process.axes[:1])[1].any()


def test_joints_that_move_too_far_for_the_tools_step_are_a_jump(wall, start, monkeypatch):
    process = wall.path.segments[0]
    index, joints = np.array([start.turntable_index]), start.joints[:1]
    to_next = wall.cell, index, joints, joints, process.positions[1:2], process.axes[1:2]
    moved, _ = advance(*to_next)
    step = np.linalg.norm(process.positions[1] - process.positions[0]) / 0.3
    largest = np.abs(moved - joints).max() - 2.0 * step
    for allowed, good in ((largest + 1e-3, True), (largest - 1e-3, False)):
        monkeypatch.setattr("nrdf.robot.planning.path_tracking._STEP_RAD", allowed)
        assert advance(*to_next)[1].all() == good


def test_an_axis_that_is_free_is_not_tilted(wall, start):
    process = wall.path.segments[0]
    index, joints = np.array([start.turntable_index]), start.joints[:1]
    _, good, axes = advance_tilted(
        wall.cell, index, joints, joints, process.positions[1:2], process.axes[1:2]
    )
    assert good.all()
    np.testing.assert_array_equal(axes, process.axes[1:2])


def test_a_free_move_ends_where_it_is_blocked(wall, start):
    process = wall.path.segments[0]
    index = np.array([start.turntable_index] * 2)
    up = process.positions[0] + np.arange(1, 5)[:, None] * [0.0, 0.012, 0.0]
    down = process.positions[0] - np.arange(1, 5)[:, None] * [0.0, 0.04, 0.0]
    joints = start.joints[[0, 0]]
    free, blocked = advance_free(wall.cell, index, joints, [up, down], process.axes[:2])
    assert len(free) == 4 and len(blocked) < 4
