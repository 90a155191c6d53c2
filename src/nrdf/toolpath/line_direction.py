"""Which way a region's lines run: along or across its longest extent, or a direction given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.geometry.frames import unit_vectors
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.strategy import Strategy

_OPEN = 0.3  # length of the mean normal: below, a region closes around itself
_LEAST = 0.2  # share of a direction's length along the region, below which it stands on it


def with_direction(region: RegionMesh, strategy: Strategy) -> Strategy:
    """The strategy with the direction that its `direction_mode` means on this region.

    Unchanged but where lines run across: then square to the direction given or, without one, to the
    region's longest extent, and along the surface.
    """
    if strategy.direction_mode == "principal":
        return replace(strategy, direction=None)
    if strategy.direction_mode != "across":
        return strategy
    left = line_axes(region, strategy)[1]
    return replace(strategy, direction=left, direction_mode="fixed")


def line_axes(region: RegionMesh, strategy: Strategy) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (3,) of a region's lines, and to the left of them, seen from outside.

    strategy: as of `with_direction`. Where the region closes around itself, left is square to the
    lines along its second longest extent.
    """
    return _axes(region, strategy.direction)


def _axes(region: RegionMesh, direction: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    mesh = region.mesh
    weights = mesh.face_areas / mesh.face_areas.sum()
    corners = mesh.vertices[mesh.faces]
    corners = corners - weights @ corners.mean(axis=1)
    # The second moment of a triangle's area, by its corners and its middle.
    places = np.concatenate([corners, 3.0 * corners.mean(axis=1, keepdims=True)], axis=1)
    spread = np.einsum("f,fka,fkb->ab", weights / 12.0, places, places)
    principal = np.linalg.eigh(spread)[1].T[::-1]
    along = principal[0] if direction is None else np.asarray(direction, dtype=np.float64)
    along = unit_vectors(along)
    outward = weights @ mesh.face_normals
    if np.linalg.norm(outward) > _OPEN:
        outward = unit_vectors(outward)
        flat = along - (along @ outward) * outward
        if direction is None and np.linalg.norm(flat) < _LEAST:
            flat = principal[1] - (principal[1] @ outward) * outward
        along = unit_vectors(flat)
        left = np.cross(outward, along)
    else:
        second = principal[np.argmin(np.abs(principal[:2] @ along))]
        left = unit_vectors(second - (second @ along) * along)
    if direction is None and along[np.argmax(np.abs(along))] < 0.0:
        # An axis has no sense of its own: the one towards larger coordinates.
        along, left = -along, -left
    return np.asarray(along), np.asarray(left)
