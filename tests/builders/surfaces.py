"""Clouds of known surfaces, in metres, points spread at random as scans and samples have them."""

from __future__ import annotations

import numpy as np

SPACING = 0.01


def board(
    length: float = 0.4, width: float = 0.3, seed: int = 0, spacing: float = SPACING
) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of a rectangle in the plane z = 0, its normal +z, a corner at 0."""
    rng = np.random.default_rng(seed)
    count = int(length * width / spacing**2)
    points = np.c_[rng.uniform(0, length, count), rng.uniform(0, width, count), np.zeros(count)]
    return points, np.tile([0.0, 0.0, 1.0], (count, 1))


def slats(gap: float = 0.06) -> tuple[np.ndarray, np.ndarray]:
    """A frame of 0.4 x 0.3 with a gap of that width through its middle, along y."""
    points, normals = board()
    open_ = (np.abs(points[:, 0] - 0.2) < gap / 2) & (np.abs(points[:, 1] - 0.15) < 0.1)
    return points[~open_], normals[~open_]


def two_sided(thickness: float = 0.004) -> tuple[np.ndarray, np.ndarray]:
    """Both sides of a thin board; the upper one comes first."""
    top, up = board(seed=1)
    bottom, _ = board(seed=2)
    return np.r_[top, bottom - [0.0, 0.0, thickness]], np.r_[up, -up]


def dome(
    radius: float = 0.25, opening: float = 1.0, seed: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """The cap of a sphere around 0, up to `opening` (rad) from +z."""
    rng = np.random.default_rng(seed)
    count = int(2 * np.pi * radius**2 * (1 - np.cos(opening)) / SPACING**2)
    z = rng.uniform(np.cos(opening), 1.0, count)
    around = rng.uniform(0, 2 * np.pi, count)
    flat = np.sqrt(1 - z**2)
    normals = np.c_[flat * np.cos(around), flat * np.sin(around), z]
    return radius * normals, normals
