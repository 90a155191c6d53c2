"""Frames, rotations and quaternions."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import (
    angles_between,
    frames_from_z_and_x,
    perpendicular,
    quaternions_wxyz,
    rotations_about,
    tangent_frames,
    unit_vectors,
    without_sign_jumps,
    xyzw_to_wxyz,
    z_axes,
)

NORMALS = unit_vectors(np.random.default_rng(0).normal(size=(50, 3)))
NORMALS[:3] = np.eye(3)


def test_unit_vectors_keep_their_direction_and_zero_stays_zero():
    np.testing.assert_allclose(
        unit_vectors([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]]), [[0, 0.6, 0.8], [0] * 3]
    )
    assert unit_vectors(np.array([2.0, 0.0, 0.0])).tolist() == [1.0, 0.0, 0.0]


def test_tangent_frames_are_right_handed_and_end_in_the_normal():
    frames = tangent_frames(NORMALS)
    np.testing.assert_array_equal(frames[:, 2], NORMALS)
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (50, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)


def test_a_perpendicular_is_square_to_every_axis():
    np.testing.assert_allclose(
        np.einsum("na,na->n", perpendicular(NORMALS), NORMALS), 0.0, atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.norm(perpendicular(NORMALS), axis=1), 1.0)


def test_a_frame_has_the_z_axis_given_and_x_as_near_as_it_can_be():
    x = np.tile([1.0, 0.2, 0.0], (50, 1))
    frames = frames_from_z_and_x(NORMALS, x)
    np.testing.assert_allclose(frames[:, :, 2], NORMALS)
    np.testing.assert_allclose(np.linalg.det(frames), 1.0)
    assert (np.einsum("na,na->n", frames[:, :, 0], x) >= -1e-12).all()
    np.testing.assert_allclose(np.einsum("na,na->n", frames[:, :, 1], x), 0.0, atol=1e-12)
    along = frames_from_z_and_x(np.eye(3), np.eye(3))  # no x is square to z
    np.testing.assert_allclose(np.linalg.det(along), 1.0)


def test_rotations_about_an_axis_are_scipys():
    angles = np.linspace(-3.0, 3.0, 7)
    axis = NORMALS[10]
    expected = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
    np.testing.assert_allclose(rotations_about(axis, angles), expected, atol=1e-12)


def test_quaternions_in_either_order():
    turned = Rotation.from_rotvec([[np.pi / 2, 0.0, 0.0], [0.5, 0.0, 0.0]])
    half = 0.5**0.5
    np.testing.assert_allclose(quaternions_wxyz(turned.as_matrix())[0], [half, half, 0, 0])
    assert xyzw_to_wxyz(np.array([1, 2, 3, 4])).tolist() == [4, 1, 2, 3]
    np.testing.assert_allclose(z_axes(turned.as_quat())[0], [0, -1, 0], atol=1e-12)


def test_signs_of_quaternions_do_not_jump():
    quaternions = Rotation.from_rotvec(
        np.linspace(0.0, 6.0, 30)[:, None] * [0.0, 0.6, 0.8]
    ).as_quat()
    quaternions[7:19] *= -1.0
    steady = without_sign_jumps(quaternions)
    assert (np.einsum("na,na->n", steady[1:], steady[:-1]) > 0.9).all()
    np.testing.assert_allclose(z_axes(steady), z_axes(quaternions))


def test_small_and_half_turns_are_told_alike():
    for angle in (0.0, 1e-9, 0.3, np.pi / 2, np.pi):
        turned = np.array([[np.cos(angle), np.sin(angle), 0.0]])
        found = angles_between(np.array([[1.0, 0.0, 0.0]]), turned)
        np.testing.assert_allclose(found, angle, rtol=1e-6, atol=1e-12)
