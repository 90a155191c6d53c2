"""Pose and scale of an object in a scan: p_scan = T_scan_canonical @ (scale * p_canonical)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.errors import CloudError

AXES = ("x", "y", "z", "-x", "-y", "-z")


@dataclass(frozen=True)
class Similarity:
    """How canonical coordinates lie in a scan.

    rotation: (3, 3), of determinant +1: left stays left; translation: (3,) and scale in the scan's
    unit. p_scan = scale * rotation @ p_canonical + translation.
    """

    rotation: np.ndarray
    translation: np.ndarray
    scale: float

    def to_scan(self, points_canonical: np.ndarray) -> np.ndarray:
        """Canonical points (n, 3) in the scan's frame and unit."""
        return self.scale * points_canonical @ self.rotation.T + self.translation

    def to_canonical(self, points_scan: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the scan in canonical coordinates."""
        return (points_scan - self.translation) @ self.rotation / self.scale

    @property
    def T_scan_canonical(self) -> np.ndarray:
        """(4, 4), rigid; it takes canonical coordinates that were multiplied by `scale`."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.translation
        return matrix

    def then(self, other: Similarity) -> Similarity:
        """First this, then `other`, whose canonical coordinates are this one's scan."""
        return Similarity(
            other.rotation @ self.rotation,
            other.to_scan(self.translation[None])[0],
            self.scale * other.scale,
        )


def upright(up: np.ndarray) -> np.ndarray:
    """A rotation (3, 3) that takes canonical +Y to the unit vector `up` (3,).

    For the axes it takes canonical axes to axes; so (0, 0, 1) gives +X for +X and -Y for +Z.
    """
    up = np.asarray(up, np.float64) / np.linalg.norm(up)
    ahead = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    return np.stack([ahead, up, np.cross(ahead, up)], axis=1)


def up_axis(name: str) -> np.ndarray:
    """The unit vector (3,) of an axis, "x" to "-z", or of three numbers, "0 0.1 1".

    Raises CloudError for anything else.
    """
    axis: np.ndarray = np.zeros(3)
    if name in AXES:
        axis["xyz".index(name[-1])] = -1.0 if name[0] == "-" else 1.0
        return axis
    try:
        axis = np.array([float(word) for word in name.replace(",", " ").split()])
    except ValueError:
        axis = np.zeros(0)
    if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
        raise CloudError(f"'{name}' is no direction; give one of {', '.join(AXES)}, or 'x y z'")
    return axis / np.linalg.norm(axis)
