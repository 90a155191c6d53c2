"""Regions of simple shapes whose distances are known: plates, boxes, tubes, bends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

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


def box(width: float = 0.4, depth: float = 0.2, height: float = 0.03) -> RegionMesh:
    """A box around the origin, in twelve triangles."""
    corner = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    # fmt: off
    faces = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                      (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])
    # fmt: on
    mesh = TargetMesh(corner * (width, depth, height), faces, ())
    return RegionMesh.from_faces(mesh, np.ones(len(faces), bool))


def cushion(width: float = 0.4, depth: float = 0.3, height: float = 0.08) -> RegionMesh:
    """A closed body without an edge: an ellipsoid, z up."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, polar = 2.0 * np.pi * u, np.pi * v
        place = np.stack(
            [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=1
        )
        return 0.5 * place * (width, depth, height)

    return flipped(sheet(place, 32, 64))


def ring(radius: float = 0.2, height: float = 0.02) -> RegionMesh:
    """The edge of a round plate, outward, z up."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        angle = 2.0 * np.pi * u
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height * v], axis=1)

    return sheet(place, 2, 96)


def arch(radius: float = 0.3, width: float = 0.05, turn: float = np.pi / 2) -> RegionMesh:
    """A flat bent strip, z up."""

    def place(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        far, angle = radius + width * (u - 0.5), turn * v
        return np.stack([far * np.cos(angle), far * np.sin(angle), 0 * u], axis=1)

    return sheet(place, 48, 4)


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


def flat_bars(bars: Sequence[tuple[float, float, float, float]]) -> RegionMesh:
    """Rectangles (x, y, width, height) in the plane z = 0 that touch without being sewn."""
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    vertices = np.concatenate([(x, y, 0.0) + corners * (w, h, 0.0) for x, y, w, h in bars])
    faces = np.array([(0, 1, 2), (0, 2, 3)])
    every = np.concatenate([faces + 4 * k for k in range(len(bars))])
    mesh = TargetMesh(vertices, every)
    return RegionMesh(mesh, mesh)
