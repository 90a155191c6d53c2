"""Canonical coordinates: what takes every object to the same place and size.

They put the centre of the bounding box at the origin and make its longest side 1:
``canonical = (original - centre) / scale``. Canonical lengths carry no unit.
"""

from __future__ import annotations

import numpy as np

from nrdf.errors import CloudError

MIRROR = np.array([1.0, 1.0, -1.0])
"""Canonical coordinates times this are those of the mirror image, left for right."""


def bounding_box(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner, each (3,), of `points` (n, 3), in their unit."""
    if len(points) == 0:
        raise CloudError("an empty point set has no bounding box; give at least one point")
    return points.min(axis=0), points.max(axis=0)


def canonical_transform(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (3,) and scale of `points` (n, 3): ``canonical = (points - centre) / scale``.

    The centre is the middle of the bounding box and the scale its longest side, both in the unit
    of `points`. Raises CloudError if there is no point or all points coincide.
    """
    lowest, highest = bounding_box(points)
    scale = float((highest - lowest).max())
    if not np.isfinite(scale) or scale <= 0.0:
        raise CloudError(
            f"the longest side of the points' bounding box is {scale}; a finite length above 0 is "
            "needed: all points coincide, or their coordinates are not finite"
        )
    return (lowest + highest) / 2.0, scale


def rotation_about_up(yaw: float | np.ndarray) -> np.ndarray:
    """Rotation (…, 3, 3) by `yaw` (rad) about canonical +Y, right-handed: from +Z towards +X."""
    yaw = np.asarray(yaw, np.float64)
    c, s, zero, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    rows = [[c, zero, s], [zero, one, zero], [-s, zero, c]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
