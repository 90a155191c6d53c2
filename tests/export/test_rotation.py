"""Each converter against scipy's Rotation or, where it uses that, against a formula of its own."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nrdf.export.rotation import (
    kuka_abc_deg,
    rotary_angles_deg,
    rotation_vectors,
    tool_axes,
    tool_z_out,
)
from nrdf.geometry.frames import xyzw_to_wxyz


def about(axis, degrees):
    """The matrix (3, 3) of a turn about x, y or z, written out."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    if axis == "x":
        return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    if axis == "y":
        return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def matrix_of(quaternion_xyzw):
    """The rotation matrix (3, 3) of a unit quaternion, written out."""
    x, y, z, w = quaternion_xyzw
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def rodrigues(vector):
    """The matrix (3, 3) of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def poses():
    """Quaternions (n, 4): random ones, gimbal lock, half turns, no turn, and nearly these."""
    rng = np.random.default_rng(0)
    random = rng.normal(size=(300, 4))
    turns = rng.uniform(-180, 180, (40, 3))
    turns[:, 1] = np.repeat([90.0, -90.0, 90.0 - 1e-7, -90.0 + 1e-5], 10)
    locked = Rotation.from_euler("ZYX", turns, degrees=True).as_quat()
    half = np.concatenate([rng.normal(size=(10, 3)), np.zeros((10, 1))], axis=1)
    nearly = half + np.array([0, 0, 0, 1e-9])
    units = np.concatenate([np.eye(4), -np.eye(4)])
    small = np.concatenate([rng.normal(size=(10, 3)) * 1e-9, np.ones((10, 1))], axis=1)
    all_of_them = np.concatenate([random, locked, half, nearly, units, small])
    return all_of_them / np.linalg.norm(all_of_them, axis=1, keepdims=True)


POSES = poses()


def assert_same_turns(matrices, quaternions_xyzw, tolerance=1e-9):
    expected = np.array([matrix_of(q) for q in quaternions_xyzw])
    np.testing.assert_allclose(matrices, expected, atol=tolerance)


def test_our_own_matrix_formula_agrees_with_scipy():
    assert_same_turns(Rotation.from_quat(POSES).as_matrix(), POSES, 1e-12)


def test_rotation_vectors():
    vectors = rotation_vectors(POSES)
    assert_same_turns([rodrigues(v) for v in vectors], POSES)
    assert np.linalg.norm(vectors, axis=1).max() <= np.pi + 1e-12
    np.testing.assert_allclose(rotation_vectors([[0, 0, 1, 0]]), [[0, 0, np.pi]])


def test_kuka_abc_even_in_gimbal_lock_and_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        angles = kuka_abc_deg(POSES)
    turned = [about("z", a) @ about("y", b) @ about("x", c) for a, b, c in angles]
    assert_same_turns(turned, POSES, 2e-7)  # scipy's own limit for what counts as locked
    assert np.abs(angles[:, 1]).max() <= 90 and np.abs(angles).max() <= 180 + 1e-9
    straight_down = Rotation.from_euler("y", 180, degrees=True).as_quat()
    np.testing.assert_allclose(np.abs(kuka_abc_deg([straight_down])), [[180, 0, 180]], atol=1e-12)


def test_quaternions_wxyz():
    ours = xyzw_to_wxyz(POSES)
    np.testing.assert_array_equal(ours[:, 0], POSES[:, 3])
    again = Rotation.from_quat(ours[:, [1, 2, 3, 0]])
    np.testing.assert_allclose((again * Rotation.from_quat(POSES).inv()).magnitude(), 0, atol=1e-7)
    np.testing.assert_array_equal(xyzw_to_wxyz(np.array([[1, 2, 3, 4]])), [[4, 1, 2, 3]])


def test_tool_z_out_turns_about_tool_x():
    expected = Rotation.from_quat(POSES) * Rotation.from_euler("x", 180, degrees=True)
    np.testing.assert_allclose(
        Rotation.from_quat(tool_z_out(POSES)).as_matrix(), expected.as_matrix(), atol=1e-12
    )
    before, after = matrix_of(POSES[0]), matrix_of(tool_z_out(POSES)[0])
    np.testing.assert_allclose(after, before * [1, -1, -1], atol=1e-12)


def test_tool_axes_point_out_of_the_part():
    expected = np.array([matrix_of(q) @ [0, 0, -1] for q in POSES])
    np.testing.assert_allclose(tool_axes(POSES), expected, atol=1e-12)


@pytest.mark.parametrize("rotary", ["AC", "BC"])
@pytest.mark.parametrize("tilt", ["positive", "negative"])
def test_rotary_angles_point_the_tool(rotary, tilt):
    axes = tool_axes(POSES)
    angles = rotary_angles_deg(axes, rotary, tilt)
    first = "x" if rotary == "AC" else "y"
    pointed = [about("z", c) @ about(first, a) @ [0, 0, 1] for a, c in angles]
    np.testing.assert_allclose(pointed, axes, atol=2e-9)
    sign = 1 if tilt == "positive" else -1
    assert (sign * angles[:, 0] >= 0).all()
    assert np.abs(np.diff(angles[:, 1])).max() <= 180 + 1e-9


def test_rotary_angles_of_known_directions():
    leaning = [[0.0, -np.sin(0.1), np.cos(0.1)], [np.sin(0.1), 0.0, np.cos(0.1)]]
    degrees = np.degrees(0.1)
    np.testing.assert_allclose(
        rotary_angles_deg(np.array(leaning)), [[degrees, 0], [degrees, 90]], atol=1e-12
    )
    np.testing.assert_allclose(
        rotary_angles_deg(np.array(leaning), "BC"), [[degrees, -90], [degrees, 0]], atol=1e-12
    )


def test_c_goes_on_around_a_cone_and_stands_still_at_the_pole():
    turn = np.radians(np.arange(0, 1080, 30))
    cone = np.stack([0.5 * np.sin(turn), -0.5 * np.cos(turn), np.full(36, 0.75**0.5)], axis=1)
    np.testing.assert_allclose(rotary_angles_deg(cone)[:, 1], np.arange(0, 1080, 30), atol=1e-9)
    pole = np.array([0.0, 0.0, 1.0])
    through = np.stack([pole, pole, cone[3], pole, cone[4], pole])
    np.testing.assert_allclose(
        rotary_angles_deg(through), [[0, 90], [0, 90], [30, 90], [0, 90], [30, 120], [0, 120]]
    )
    np.testing.assert_array_equal(rotary_angles_deg(pole[None]), [[0, 0]])
