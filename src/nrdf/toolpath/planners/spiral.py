"""Spiral: one stroke from a region's border to its middle, without lifting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polyline_corners import resample_with_corners
from nrdf.geometry.polylines import (
    arc_length,
    interpolate,
    resample,
    step_lengths,
    total_length,
)
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.contour import RING_EDGE, ring_lines
from nrdf.toolpath.planners.field_lines import Part, checked, parts_of
from nrdf.toolpath.planners.ordering import snake_order
from nrdf.toolpath.planners.steady_spiral import steady_spiral
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_STEP = 2.0  # spacings: a longer step lifts the tool
_FINE = 0.125  # of a stepover: between points of rings, before they are joined


def plan_spiral(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """One stroke for each part whose rings lie within one another; more where rings part.

    From the border inward, at every turn evenly one stepover farther from it. A tool with a radius
    below the stepover goes along the border first. Around holes, and where rings part,
    from one ring to the next, as of `nrdf.toolpath.planners.contour`. Raises ProcessError for a
    margin that leaves nothing.
    """
    found: list[SurfacePath] = []
    for part in parts_of(region, strategy, RING_EDGE):
        paths = [
            path for line in _spirals(part, strategy) for path in _placed(region, line, strategy)
        ]
        found += snake_order(paths, list(range(len(paths))), strategy.stepover_m)
    return checked(found, strategy)


def _spirals(part: Part, strategy: Strategy) -> list[np.ndarray]:
    """Lines (n, 3) near the part's surface."""
    steady = steady_spiral(part, strategy)
    if steady is not None:
        return [steady]
    lines = [line for line in ring_lines(part, strategy) if line.closed]
    rings = [resample(line.points, _FINE * strategy.stepover_m) for line in lines]
    nested = _nested(rings, [line.level for line in lines])
    return [_joined([rings[k] for k in chain]) for chain in nested]


def _nested(rings: Sequence[np.ndarray], levels: Sequence[int]) -> list[list[int]]:
    """Chains of rings, each around the next: of several within a ring, the longest goes on."""
    inner: dict[int, list[int]] = {}
    outermost = []
    for k, level in enumerate(levels):
        around = [j for j, other in enumerate(levels) if other == level - 1]
        if not around:
            outermost.append(k)
            continue
        away = [float(cKDTree(rings[j]).query(rings[k])[0].mean()) for j in around]
        inner.setdefault(around[int(np.argmin(away))], []).append(k)
    chains = []
    while outermost:
        chain = [outermost.pop(0)]
        while within := sorted(inner.get(chain[-1], []), key=lambda k: -len(rings[k])):
            chain.append(within[0])
            outermost += within[1:]
        chains.append(chain)
    return chains


def _joined(rings: Sequence[np.ndarray]) -> np.ndarray:
    """One line (n, 3) through closed rings, the outermost first."""
    here = rings[0]
    pieces = [here]
    for following in rings[1:]:
        share = arc_length(here) / arc_length(here)[-1]
        across = following[cKDTree(following).query(here)[1]]
        pieces.append(here + share[:, None] * (across - here))
        here = _started_at(following, pieces[-1][-1], here[1] - here[0])
    if len(rings) > 1:
        pieces.append(here)
    return np.concatenate(pieces)


def _started_at(ring: np.ndarray, place: np.ndarray, travel: np.ndarray) -> np.ndarray:
    """A closed ring (n, 3) from its point nearest to a place (3,), in the sense of a step (3,)."""
    open_ring = ring[:-1]
    first = int(np.argmin(np.linalg.norm(open_ring - place, axis=1)))
    turned = np.roll(open_ring, -first, axis=0)
    if (turned[1] - turned[-1]) @ travel < 0.0:
        turned = np.concatenate([turned[:1], turned[:0:-1]])
    return np.concatenate([turned, turned[:1]])


def _placed(region: RegionMesh, line: np.ndarray, strategy: Strategy) -> list[SurfacePath]:
    """A line near the surface on the nearest triangles that look the same way; broken at steps of
    more than two spacings."""
    along = arc_length(line)
    near = region.mesh.nearest(line)
    even, at = resample_with_corners(line, strategy.spacing_m)
    found = region.mesh.nearest(even, unit_vectors(interpolate(at, along, near.normals)))
    normals = region.mesh.smooth_normals(found.points, found.faces, strategy.tool_radius_m)
    far = np.flatnonzero(step_lengths(found.points) > _STEP * strategy.spacing_m) + 1
    pieces = zip(np.split(found.points, far), np.split(normals, far), strict=True)
    return [
        SurfacePath(points, outward)
        for points, outward in pieces
        if total_length(points) >= strategy.tool_radius_m
    ]
