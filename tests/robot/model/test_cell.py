from __future__ import annotations

import numpy as np
import pytest

from builders.arm_cells import UP
from nrdf.robot.model.cell import Cell, Placement, upright_rotation

STILL = np.array([[0.3, -1.2, 1.4, -1.0, -1.5, 0.2]])


def test_the_object_turns_about_the_turntables_axis(wall):
    cell = wall.cell
    placement = Placement((0.75, 0.0, 0.3), np.pi, 0.1, (0.0, 0.7))
    placed = Cell.build(cell.arm, cell.tool, cell.distance_field, placement, UP)
    turned = cell.at_turntable_angles(np.array([0.7]))
    np.testing.assert_allclose(turned.T_base_object[0], placed.T_base_object[1], atol=1e-12)


def test_up_becomes_z_and_forward_x_even_where_forward_is_up():
    up, forward = np.array([0.0, 2.0, 0.0]), np.array([3.0, 1.0, 0.0])
    rotation = upright_rotation(up, forward)
    np.testing.assert_allclose(rotation @ up, [0, 0, 2], atol=1e-12)
    np.testing.assert_allclose(rotation @ [1.0, 0.0, 0.0], [1, 0, 0], atol=1e-12)
    lost = upright_rotation(up, up)
    np.testing.assert_allclose(lost @ lost.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(lost @ up, [0, 0, 2], atol=1e-12)


def test_clearance_is_to_the_object_or_to_the_floor_whichever_is_nearer(cell):
    index = np.zeros(1, int)
    frames = cell.chain.frames(STILL)
    near = cell.clearance(frames, index)
    down = STILL.copy()
    down[0, 1] = 0.0  # stretched out sideways, 0.4 m above the floor
    floor = cell.clearance(cell.chain.frames(down), index)
    assert near.least[0] > 0.0
    # The object's shift by 10 mm changes the distance by at most that.
    shifted = cell.shifted(np.array([0.0, 0.01, 0.0])).clearance(frames, index)
    assert abs(shifted.least[0] - near.least[0]) <= 0.0105
    buried = Cell.build(
        cell.arm, cell.tool, cell.distance_field, Placement((3, 0, 0.02), 0.0, 0.0, (0.0,)), UP
    )
    low = buried.clearance(buried.chain.frames(np.array([[0.0, 0.3, 0, 0, 0, 0]])), index)
    assert low.floor[0] and low.least[0] < 0.0 and low.gradient[0].tolist() == [0, 0, 1]
    assert floor.least[0] < near.least[0] + 1.0


def test_a_folded_arm_touches_itself_and_a_stretched_one_does_not(cell):
    folded = STILL.copy()
    folded[0, 2] = cell.chain.upper[2]
    clear = cell.self_clearance(cell.chain.frames(np.concatenate([STILL, folded])))
    assert clear[0] > 0.0 > clear[1]


def test_points_and_vectors_go_to_the_bases_frame(cell):
    at, along = cell.to_base(np.zeros(1, int), np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(at[0], cell.T_base_object[0, :3, 3])
    assert along[0, 2] == pytest.approx(1.0)
