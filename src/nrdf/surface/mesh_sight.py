"""What of a mesh can be seen from outside, by rays: what must be left of it after repairs."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

_DIRECTIONS, _RAYS = 60, 120
_TURN = np.pi * (1.0 + np.sqrt(5.0))  # between directions, so that they spread evenly
_SAME = 2e-5  # longest sides from a surface, within which a place lies on it


@dataclass(frozen=True)
class Seen:
    """Places (n, 3) on a mesh that rays from far outside meet first, and their faces (n,).
    near: how far from a surface a place may be to lie on it, in their unit."""

    points: np.ndarray
    faces: np.ndarray
    near: float

    @staticmethod
    def of(vertices: np.ndarray, faces: np.ndarray, rng: np.random.Generator) -> Seen:
        """Of a mesh (v, 3), (f, 3): random rays from 60 directions."""
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        number = np.arange(_DIRECTIONS) + 0.5
        height = 1.0 - 2.0 * number / _DIRECTIONS
        wide = np.sqrt(1.0 - height**2)
        turn = _TURN * number
        ways = np.stack([wide * np.cos(turn), wide * np.sin(turn), height], axis=1)
        starts = []
        for way in ways:
            beside = np.linalg.svd(way[None])[2][1:]
            flat = (vertices - (low + high) / 2.0) @ beside.T
            at = rng.uniform(flat.min(axis=0), flat.max(axis=0), (_RAYS, 2))
            starts.append((low + high) / 2.0 + at @ beside - np.linalg.norm(high - low) * way)
        start, way = np.concatenate(starts), np.repeat(ways, _RAYS, axis=0)
        tree, vertices, faces = _tree(vertices, faces)
        face, away, _ = tree.intersect_ray_first(vertices, faces, start, way)
        face = np.asarray(face)
        hit = face >= 0
        points = start[hit] + np.asarray(away)[hit, None] * way[hit]
        return Seen(points, face[hit], _SAME * float((high - low).max()))

    def lost(self, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
        """Which of the places (n,) do not lie on another mesh (v, 3), (f, 3)."""
        if not len(self.points) or not len(faces):
            return np.ones(len(self.points), bool)
        tree, vertices, faces = _tree(vertices, faces)
        points = np.ascontiguousarray(self.points)
        squared = np.asarray(tree.squared_distance(vertices, faces, points)[0])
        return np.asarray(squared > self.near**2)


def _tree(vertices: np.ndarray, faces: np.ndarray) -> tuple[igl.AABB, np.ndarray, np.ndarray]:
    vertices, faces = np.ascontiguousarray(vertices), np.ascontiguousarray(faces)
    tree = igl.AABB()
    tree.init(vertices, faces)
    return tree, vertices, faces
