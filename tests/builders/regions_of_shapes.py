"""Regions of simple shapes whose distances are known: plate, plate with a hole, tube, cap, bend."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh


def sheet(
    place: Callable[[np.ndarray, np.ndarray], np.ndarray], rows: int, columns: int
) -> RegionMesh:
    """place: from u, v (n,) in 0..1 to points (n, 3); u runs along the columns. Seams merge."""
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    points = place(u.ravel(), v.ravel())
    _, first, merged = np.unique(
        np.round(points, 9), axis=0, return_index=True, return_inverse=True
    )
    index = merged.ravel().reshape(rows + 1, columns + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate(
        [np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    )
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    mesh = TargetMesh(points[first], faces, ())
    return RegionMesh.from_faces(mesh, np.ones(len(faces), bool))


def plate(width: float = 0.4, depth: float = 0.2) -> RegionMesh:
    """A plate in two triangles, z up."""
    return sheet(lambda u, v: np.stack([width * u, depth * v, 0 * u], axis=1), 1, 1)


def plate_with_hole(width: float = 0.4, depth: float = 0.3, radius: float = 0.05) -> RegionMesh:
    """A plate whose middle is cut out, a disc, about."""
    whole = sheet(
        lambda u, v: np.stack([width * (u - 0.5), depth * (v - 0.5), 0 * u], axis=1), 60, 80
    )
    centre = whole.mesh.vertices[whole.mesh.faces].mean(axis=1)
    return RegionMesh.from_faces(whole.mesh, np.linalg.norm(centre, axis=1) > radius)


def disc(radius: float = 0.1) -> RegionMesh:
    """A disc, z up."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        angle = 2.0 * np.pi * u
        return np.stack([radius * v * np.cos(angle), radius * v * np.sin(angle), 0 * u], axis=1)

    return flipped(sheet(place, 10, 64))


def tube(radius: float = 0.03, length: float = 0.4, share: float = 1.0) -> RegionMesh:
    """A tube along x, or a share of its section."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        angle = share * 2.0 * np.pi * u
        return np.stack([length * v, radius * np.cos(angle), radius * np.sin(angle)], axis=1)

    return flipped(sheet(place, 1, 48))


def cap(radius: float = 0.2, opening: float = 1.0) -> RegionMesh:
    """A part of a sphere about z, up to the angle `opening` (rad) from its pole."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        angle, polar = 2.0 * np.pi * u, opening * v
        return radius * np.stack(
            [np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)], axis=1
        )

    return flipped(sheet(place, 24, 64))


def bend(large: float = 0.2, small: float = 0.02, turn: float = np.pi / 2) -> RegionMesh:
    """A bent rod: a part of a torus about z, around its whole section."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, along = 2.0 * np.pi * u, turn * v
        far = large + small * np.cos(around)
        return np.stack([far * np.cos(along), far * np.sin(along), small * np.sin(around)], axis=1)

    return sheet(place, 48, 32)


def flipped(region: RegionMesh) -> RegionMesh:
    """The same, its other side outward."""
    faces = region.mesh.faces[:, ::-1].copy()
    mesh = TargetMesh(region.mesh.vertices, faces, ())
    return RegionMesh.from_faces(mesh, np.ones(len(faces), bool))
