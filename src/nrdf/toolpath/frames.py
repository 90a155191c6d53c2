"""Tool frames on a surface: x along the travel, z into the part, leaned as asked for."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.surface.surface import unit


def travel_of(positions: np.ndarray, smooth_m: float = 0.0) -> np.ndarray:
    """Unit directions of travel (n, 3) along positions (n, 3), m, n >= 2.

    Averaged over `smooth_m` of the way to either side, which takes the suddenness out of corners.
    A line that ends where it began is taken as closed.
    """
    steps = np.diff(positions, axis=0)
    closed = len(positions) > 3 and np.allclose(positions[0], positions[-1], atol=1e-9)
    length = np.linalg.norm(steps, axis=1)
    reach = int(np.ceil(smooth_m / max(float(length.mean()), 1e-12)))
    # A window of 2 reach + 2 steps around each waypoint, at least the ones before and after it.
    reach = min(reach, (len(steps) - 2) // 2) if closed else reach
    count = reach + 1
    ends = (steps[-count:], steps[:count]) if closed else (steps[:0], steps[:0])
    padded = np.concatenate([ends[0], steps, ends[1]])
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(padded, axis=0)])
    at = np.arange(len(positions)) + len(ends[0])
    first = np.maximum(at - count, 0)
    last = np.minimum(at + count, len(padded))
    return unit(total[last] - total[first])


def surface_frames(travel: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3), columns x, y, z, of an upright tool.

    travel: (n, 3), need not be tangential; normals: (n, 3), unit, outward. z = -normal, x is the
    travel in the tangent plane, y = z × x is to the right of the travel seen from outside.
    """
    z = -unit(normals)
    y = np.cross(z, travel)
    # Straight in or out of the surface there is no travel in it: any x will do.
    helper = np.where(np.abs(z[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    lost = np.linalg.norm(y, axis=1, keepdims=True) < 1e-6
    y = unit(np.where(lost, np.cross(z, helper), y))
    return np.stack([np.cross(y, z), y, z], axis=-1)


def lean_rotation(lead_rad: float, tilt_rad: float) -> Rotation:
    """The turn of a tool in its own upright frame that leans it: first by lead, then by tilt.

    A positive lead leans the tool's tail (the end away from the part) towards the travel, a
    positive tilt to its right; they turn about tool y by -lead and then about tool x by tilt.
    """
    return Rotation.from_euler("YX", [-lead_rad, tilt_rad])


def tool_quaternions(
    travel: np.ndarray, normals: np.ndarray, lead_rad: float = 0.0, tilt_rad: float = 0.0
) -> np.ndarray:
    """Unit quaternions (n, 4), x y z w, of leaned tools, without jumps of sign.

    travel, normals: (n, 3), as for `surface_frames`; lead and tilt as for `lean_rotation`.
    """
    upright = Rotation.from_matrix(surface_frames(travel, normals))
    return steady((upright * lean_rotation(lead_rad, tilt_rad)).as_quat())


def steady(quaternions: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) of the same rotations, their signs chosen so that none jumps."""
    same = np.einsum("na,na->n", quaternions[1:], quaternions[:-1]) >= 0.0
    sign = np.concatenate([[1.0], np.cumprod(np.where(same, 1.0, -1.0))])
    return quaternions * sign[:, None]
