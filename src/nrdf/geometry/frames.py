"""Unit vectors, frames on surfaces, and quaternions.

A frame is a rotation matrix (3, 3). Quaternions are x, y, z, w unless their name says otherwise.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation


def unit_vectors(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) brought to unit length; zero stays zero."""
    vectors = np.asarray(vectors)
    length = np.sqrt(np.einsum("...a,...a->...", vectors, vectors))  # several times as fast as norm
    return vectors / np.maximum(length, 1e-12)[..., None]


SIDES = unit_vectors(
    np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z])
)
"""Directions (26, 3) all around; none is farther than 28° from one of them."""


def angles_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Angles (n,), rad, between unit vectors (n, 3)."""
    # The chord tells small angles better than the cosine does.
    chord = np.linalg.norm(other - one, axis=1)
    return np.asarray(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))


def perpendicular(axes: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) square to unit vectors (n, 3): to each of them and to x, or to y where
    it is along x itself."""
    helper = np.where(np.abs(axes[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    return unit_vectors(np.cross(axes, helper))


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """Right-handed frames (m, 3, 3) at unit normals (m, 3): rows are two tangents, the normal."""
    x, y, z = normals.T
    zero = np.zeros_like(x)
    flat = np.abs(x) < 0.7  # the first is square to the x axis, or to y where the normal is along x
    first = np.stack([np.where(flat, zero, -z), np.where(flat, z, zero), np.where(flat, -y, x)])
    u, v, w = first / np.maximum(np.sqrt((first * first).sum(axis=0)), 1e-12)
    frames = np.stack([u, v, w, y * w - z * v, z * u - x * w, x * v - y * u, x, y, z], axis=1)
    return frames.reshape(-1, 3, 3)


def frames_from_z_and_x(z: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3), columns x, y, z, from unit z axes (n, 3) and wanted x axes (n, 3).

    The x axis is brought square to z; where it is along z, any x is taken.
    """
    y = np.cross(z, x)
    lost = np.linalg.norm(y, axis=1, keepdims=True) < 1e-6
    y = np.where(lost, perpendicular(z), unit_vectors(y))
    return np.stack([np.cross(y, z), y, z], axis=-1)


def rotations_about(axis: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Rotations (b, 3, 3) about one unit axis (3,) by angles (b,): Rodrigues' formula."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(angles_rad), 1.0 - np.cos(angles_rad)
    return np.asarray(
        np.eye(3) + sine[:, None, None] * skew + versine[:, None, None] * (skew @ skew)
    )


def z_axes(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """The z axes (n, 3) of frames given as quaternions (n, 4): of a tool, into the part."""
    return np.asarray(Rotation.from_quat(quaternions_xyzw).as_matrix()[:, :, 2])


def quaternions_wxyz(rotations: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4), w first, of rotations (..., 3, 3): the order of MuJoCo and viser."""
    return xyzw_to_wxyz(Rotation.from_matrix(rotations).as_quat())


def xyzw_to_wxyz(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """Quaternions (..., 4) with w first instead of last."""
    return np.asarray(quaternions_xyzw)[..., [3, 0, 1, 2]]


def without_sign_jumps(quaternions: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) of the same rotations, their signs chosen so that none jumps."""
    same = np.einsum("na,na->n", quaternions[1:], quaternions[:-1]) >= 0.0
    sign = np.concatenate([[1.0], np.cumprod(np.where(same, 1.0, -1.0))])
    return quaternions * sign[:, None]
