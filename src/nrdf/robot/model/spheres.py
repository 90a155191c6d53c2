"""Spheres that enclose an arm's shapes, for distances to what it must not touch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

_MOST_ALONG = 24
FINE, COARSE = 0.9, 1.5
"""Distances between centres, in radii: many that follow a shape closely, or few."""


@dataclass(frozen=True)
class Spheres:
    """Spheres fixed to links: centres (m, 3) in the link's frame, radii (m,), m, and links (m,).

    A link is the number of joints between it and the base.
    """

    centres: np.ndarray
    radii: np.ndarray
    links: np.ndarray

    def __add__(self, other: Spheres) -> Spheres:
        return Spheres(
            np.concatenate([self.centres, other.centres]),
            np.concatenate([self.radii, other.radii]),
            np.concatenate([self.links, other.links]),
        )

    @staticmethod
    def none() -> Spheres:
        """No spheres."""
        return Spheres(np.zeros((0, 3)), np.zeros(0), np.zeros(0, int))

    def at(self, rotations: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Centres (b, m, 3) where the links' frames are (n + 1, b, 3, 3) and (n + 1, b, 3)."""
        centres = np.empty((positions.shape[1], len(self.radii), 3))
        for link, rows, local in self._by_link:
            turned = np.matmul(local, np.swapaxes(rotations[link], 1, 2))
            centres[:, rows] = turned + positions[link][:, None]
        return centres

    @cached_property
    def _by_link(self) -> list[tuple[int, np.ndarray, np.ndarray]]:
        parts = [(int(link), np.flatnonzero(self.links == link)) for link in np.unique(self.links)]
        return [(link, own, self.centres[own]) for link, own in parts]


def cover_capsule(
    start: np.ndarray, end: np.ndarray, radius: float, step: float = FINE
) -> tuple[np.ndarray, float]:
    """Centres (k, 3) and the common radius of spheres that enclose a capsule."""
    length = float(np.linalg.norm(end - start))
    count = int(np.clip(np.ceil(length / (step * radius)), 1, _MOST_ALONG))
    half = 0.5 * length / count
    # Between centres the spheres must still reach the capsule's side.
    at = np.linspace(0.0, 1.0, count + 1)
    return start + at[:, None] * (end - start), float(np.hypot(radius, half))


def cover_box(half: np.ndarray, step: float = FINE) -> tuple[np.ndarray, float]:
    """Centres (k, 3) and the common radius of spheres that enclose a box of half sizes (3,)."""
    cell = max(step / FINE * 2.0 * float(half.min()), 2.0 * float(half.max()) / _MOST_ALONG, 1e-3)
    counts = np.ceil(2.0 * half / cell - 1e-9).astype(int).clip(1)
    size = 2.0 * half / counts
    axes = [size[k] * (np.arange(counts[k]) + 0.5) - half[k] for k in range(3)]
    centres = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return centres, float(0.5 * np.linalg.norm(size))


def cover_cylinder(radius: float, half: float, step: float = FINE) -> tuple[np.ndarray, float]:
    """Centres (k, 3) and the common radius of spheres that enclose a cylinder about z."""
    if half >= 0.5 * radius or step > FINE:
        count = max(int(2.0 * half / (step * radius)), 1)
        size = half / count
        at = size * (2.0 * np.arange(count) + 1.0) - half
        return np.stack([0.0 * at, 0.0 * at, at], axis=1), float(np.hypot(radius, size))
    # A flat one: rings of spheres, so that little sticks out of the faces.
    ball = np.sqrt(1.5) * half
    inner = max(radius - 0.5 * half, 0.0)
    centres = [np.zeros((1, 3))]
    for ring in np.linspace(0.0, inner, max(int(np.ceil(inner / half)), 1) + 1)[1:]:
        angle = np.arange(n := int(np.ceil(2.0 * np.pi * ring / half))) * 2.0 * np.pi / n
        centres.append(ring * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))
    return np.concatenate(centres), float(ball)
