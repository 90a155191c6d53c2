"""Orientations as controllers write them.

`quaternions_xyzw` (n, 4) are unit and rotate from the tool frame to the frame that positions are
in; tool z points into the part.
"""

from __future__ import annotations

import warnings
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import z_axes

_POLE = 1e-9


def tool_z_out(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """The same tools (n, 4) with z out of the part: turned by 180 degrees about tool x."""
    x, y, z, w = np.asarray(quaternions_xyzw, dtype=np.float64).T
    return np.stack([w, z, -y, -x], axis=1)


def rotation_vectors(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """Rotation vectors (n, 3) rad, axis times angle in [0, pi]: Universal Robots' rx ry rz."""
    return Rotation.from_quat(quaternions_xyzw).as_rotvec()


def kuka_abc_deg(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """KUKA's A B C (n, 3) in degrees: about z, then the new y, then the new x; R = Rz Ry Rx.

    B is in [-90, 90]. Where it is 90 or -90, A and C turn about the same axis, and C is 0.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return Rotation.from_quat(quaternions_xyzw).as_euler("ZYX", degrees=True)


def tool_axes(quaternions_xyzw: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) from the tool's tip to its holder, out of the part: APT's i j k."""
    return -z_axes(quaternions_xyzw)


def rotary_angles_deg(
    axes: np.ndarray,
    rotary: Literal["AC", "BC"] = "AC",
    tilt: Literal["positive", "negative"] = "positive",
) -> np.ndarray:
    """Angles (n, 2) in degrees, A or B first, C second, that point a tool along `axes` (n, 3).

    `axes` are unit, from tip to holder, in the part's frame; at zero angles the tool stands along
    +Z. Angles count as ISO 841 does, as the tool moves in relation to the part, so they are the
    same for tables, heads and one of each, as long as C is nearer to the part:
    axis = Rz(C) Rx(A) z, or Rz(C) Ry(B) z. C goes on beyond a full turn rather than jump, and
    stands still where the tool points along Z and C does not matter.
    """
    sideways = np.hypot(axes[:, 0], axes[:, 1])
    first = np.degrees(np.arctan2(sideways, axes[:, 2]))
    i, j = axes[:, 0], axes[:, 1]
    second = np.arctan2(i, -j) if rotary == "AC" else np.arctan2(j, i)
    if tilt == "negative":
        first, second = -first, second + np.pi
    free = np.flatnonzero(sideways > _POLE)
    if len(free) == 0:
        return np.stack([first, np.zeros(len(axes))], axis=1)
    unwrapped = np.unwrap(second[free])
    # Before the first that counts, and between two, the last that counted.
    last = np.clip(np.searchsorted(free, np.arange(len(axes)), side="right") - 1, 0, None)
    return np.stack([first, np.degrees(unwrapped[last])], axis=1)
