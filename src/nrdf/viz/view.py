"""What all drawings share: the camera, outlines set off by depth, and finer pixels made coarse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OVERSAMPLING = 2
"""Fine pixels along each side of a pixel."""


@dataclass(frozen=True)
class Camera:
    """Orthographic view: `azimuth` (rad) about +Y from +X towards +Z, `elevation` (rad)."""

    azimuth: float
    elevation: float

    def axes(self) -> np.ndarray:
        """Rows right, up, towards the viewer, each a unit vector: (3, 3)."""
        a, e = self.azimuth, self.elevation
        toward = np.array([np.cos(e) * np.cos(a), np.sin(e), np.cos(e) * np.sin(a)])
        right = np.array([np.sin(a), 0.0, -np.cos(a)])
        return np.stack([right, np.cross(toward, right), toward])

    @staticmethod
    def towards(normal: np.ndarray) -> Camera:
        """A view that sees a surface with this normal (3,) well, and somewhat from the front."""
        length = float(np.linalg.norm(normal))
        looked = 0.35 * FRONT.axes()[2] + (normal / length if length > 0.1 else 0.0)
        flat = float(np.hypot(looked[0], looked[2]))
        azimuth = float(np.arctan2(looked[2], looked[0])) if flat > 1e-6 else FRONT.azimuth
        return Camera(azimuth, float(np.clip(np.arctan2(looked[1], flat), -1.2, 1.2)))


FRONT = Camera(0.65, 0.38)


def reduced(image: np.ndarray) -> np.ndarray:
    """The mean (h, w, 3), in [0, 1], of each pixel's fine ones (h k, w k, 3)."""
    steps = range(OVERSAMPLING)
    parts = [image[i::OVERSAMPLING, j::OVERSAMPLING] for i in steps for j in steps]
    return np.clip(np.add.reduce(parts) / np.float32(len(parts)), 0.0, 1.0)


def eye_dome(depth: np.ndarray, reach: int) -> np.ndarray:
    """Factor in (0, 1] that darkens pixels just behind a nearer neighbour."""
    # The background is far behind, but its own pixels stay white.
    background = depth <= -1.5
    total = np.zeros_like(depth)
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        for r in (reach, 2 * reach):
            shifted = np.roll(depth, (r * dy, r * dx), axis=(0, 1))
            total += np.clip(shifted - depth - np.float32(0.006), 0.0, np.float32(0.12))
    return np.where(background, 1.0, np.exp(-1.6 * total))
