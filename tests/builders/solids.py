"""Simple surfaces with known normals, for the tests."""

from __future__ import annotations

import numpy as np


def box(size, count: int, seed: int = 0, centre=(0.0, 0.0, 0.0)):
    """Points (count, 3), even over the faces of a box of `size` (3,), and their normals."""
    rng = np.random.default_rng(seed)
    half = np.asarray(size, float) / 2
    area = np.array([half[1] * half[2], half[0] * half[2], half[0] * half[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    points = rng.uniform(-1, 1, (count, 3))
    side = np.where(rng.random(count) < 0.5, -1.0, 1.0)
    points[np.arange(count), axis] = side
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = side
    return points * half + np.asarray(centre), normals
