"""Tool frames: which way they point, and that they are steady."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import unit_vectors, without_sign_jumps
from nrdf.toolpath.frames import surface_frames, tilt_rotation, tool_quaternions, travel_directions

FORWARD, UP, RIGHT = np.eye(3)[0], np.eye(3)[2], -np.eye(3)[1]


def test_frames_are_right_handed_with_z_into_the_part_and_x_along_the_travel():
    rng = np.random.default_rng(0)
    travel, normals = rng.normal(size=(2, 200, 3))
    normals = unit_vectors(normals)
    frames = surface_frames(travel, normals)
    np.testing.assert_allclose(frames.transpose(0, 2, 1) @ frames, [np.eye(3)] * 200, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    np.testing.assert_allclose(frames[:, :, 2], -normals)
    assert (np.einsum("na,na->n", frames[:, :, 0], travel) > 0.0).all()


def test_a_travel_along_the_normal_still_gives_a_frame():
    frames = surface_frames(np.array([UP]), np.array([UP]))
    np.testing.assert_allclose(frames[0].T @ frames[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frames[0, :, 2], -UP)


@pytest.mark.parametrize("angle", [0.2, -0.4])
def test_lead_tilts_the_tail_towards_the_travel_and_tilt_to_its_right(angle):
    for lead, tilt, side in ((angle, 0.0, FORWARD), (0.0, angle, RIGHT)):
        quaternions = tool_quaternions(np.array([FORWARD]), np.array([UP]), lead, tilt)
        tail = -Rotation.from_quat(quaternions[0]).as_matrix()[:, 2]
        np.testing.assert_allclose(tail, np.cos(angle) * UP + np.sin(angle) * side, atol=1e-12)


def test_lead_and_tilt_are_turns_about_the_tools_own_axes():
    turn = tilt_rotation(0.3, 0.2)
    np.testing.assert_allclose(
        turn.as_matrix(),
        (Rotation.from_rotvec([0, -0.3, 0]) * Rotation.from_rotvec([0.2, 0, 0])).as_matrix(),
        atol=1e-12,
    )


def test_quaternions_do_not_change_sign_along_a_circle():
    angle = np.linspace(0, 4 * np.pi, 100)
    travel = np.c_[-np.sin(angle), np.cos(angle), np.zeros(100)]
    quaternions = tool_quaternions(travel, np.tile(UP, (100, 1)), 0.1, 0.2)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0)
    assert np.abs(np.diff(quaternions, axis=0)).max() < 0.1
    flipped = quaternions * np.where(np.arange(100) % 3 == 0, -1.0, 1.0)[:, None]
    assert np.abs(np.diff(without_sign_jumps(flipped), axis=0)).max() < 0.1


def test_travel_is_central_and_smoothed_over_corners():
    corner = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0.0]])
    np.testing.assert_allclose(
        travel_directions(corner)[[0, 2, 4]], [FORWARD, unit_vectors([1, 1, 0]), -RIGHT]
    )
    np.testing.assert_allclose(travel_directions(corner, 1.0)[1], unit_vectors(np.array([2, 1, 0])))


def test_the_travel_of_a_closed_line_goes_on_over_its_ends():
    angle = np.linspace(0, 2 * np.pi, 41)
    circle = np.c_[np.cos(angle), np.sin(angle), np.zeros(41)]
    wanted = np.c_[-np.sin(angle), np.cos(angle), np.zeros(41)]
    for smooth in (0.0, 0.3):
        np.testing.assert_allclose(travel_directions(circle, smooth), wanted, atol=1e-9)
