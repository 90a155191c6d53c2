"""Tool frames on a surface: x along the travel, z into the part, tilted by lead and tilt."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.geometry.frames import frames_from_z_and_x, unit_vectors, without_sign_jumps


def travel_directions(positions: np.ndarray, smooth_m: float = 0.0) -> np.ndarray:
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
    return unit_vectors(total[last] - total[first])


def surface_frames(travel: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3), columns x, y, z, of an upright tool.

    travel: (n, 3), need not be tangential; normals: (n, 3), unit, outward. z = -normal, x is the
    travel in the tangent plane, y = z × x is to the right of the travel seen from outside.
    """
    return frames_from_z_and_x(-unit_vectors(normals), travel)


def tilt_rotation(lead_rad: float, tilt_rad: float) -> Rotation:
    """The rotation that tilts a tool in its own upright frame: first by lead, then by tilt.

    A positive lead tilts the tool's tail (the end away from the part) towards the travel, a
    positive tilt to its right; they turn about tool y by -lead and then about tool x by tilt.
    """
    return Rotation.from_euler("YX", [-lead_rad, tilt_rad])


def tool_quaternions(
    travel: np.ndarray, normals: np.ndarray, lead_rad: float = 0.0, tilt_rad: float = 0.0
) -> np.ndarray:
    """Unit quaternions (n, 4), x y z w, of tilted tools, without jumps of sign.

    travel, normals: (n, 3), as for `surface_frames`; lead and tilt as for `tilt_rotation`.
    """
    upright = Rotation.from_matrix(surface_frames(travel, normals))
    return without_sign_jumps((upright * tilt_rotation(lead_rad, tilt_rad)).as_quat())
