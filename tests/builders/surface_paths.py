"""Paths on simple surfaces."""

from __future__ import annotations

import numpy as np

from nrdf.toolpath.surface_path import SurfacePath

UP = np.array([0.0, 0.0, 1.0])


def straight(start, stop, spacing: float = 0.01, normal=UP) -> SurfacePath:
    """A straight path with even steps."""
    start, stop = np.asarray(start, float), np.asarray(stop, float)
    count = round(float(np.linalg.norm(stop - start)) / spacing) + 1
    contacts = start + np.linspace(0.0, 1.0, count)[:, None] * (stop - start)
    return SurfacePath(contacts, np.tile(np.asarray(normal, float), (count, 1)))


def rows(places, length: float = 0.2) -> list[SurfacePath]:
    """Paths along +X at places y, on the plane z = 0."""
    return [straight((0, y, 0), (length, y, 0)) for y in places]


def over_an_edge(angle_rad: float, spacing: float = 0.01) -> SurfacePath:
    """A path over an edge at x = 0.1, behind which the normal is turned by an angle about +Y."""
    path = straight((0, 0, 0), (0.2, 0, 0), spacing)
    normals = path.normals.copy()
    normals[path.contacts[:, 0] > 0.1 + 1e-9] = [np.sin(angle_rad), 0.0, np.cos(angle_rad)]
    return SurfacePath(path.contacts, normals)
