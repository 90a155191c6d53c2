"""Contour and edge: lines at even distances from a region's border, and along it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.geometry.polyline_corners import corners_of
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import distance_from
from nrdf.toolpath.planners.field_lines import Part, checked, driven, lines_at, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine, level_lines
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_CORNERED = 0.95
"""Stepovers: in a square corner the largest disc between two rings is 1.17 times as wide as they
are apart, which must be less than 1.15 stepovers."""
RING_EDGE = 0.3  # stepovers: triangles cut the corners of rings off, coarse ones more
_ON_EDGE = 1e-3  # of the stepover: an edge path without margin runs that far inside, on triangles


def plan_contour(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Closed rings at even distances from the border, the holes' too.

    With a start, outside or inside, every ring comes after those that are farther out. A part
    without a border has its rings around its end. Raises ProcessError for a margin that leaves
    nothing.
    """
    found = []
    for part in parts_of(region, strategy, RING_EDGE):
        found += _in_turn(region, part, ring_lines(part, strategy), strategy)
    return checked(found, strategy)


def plan_edge(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """One loop along the outer border and one around every hole, `edge_margin_m` inside.

    With a start, outside or inside, the outer border comes before the holes.

    Raises ProcessError for a margin that leaves nothing, as where there is no border.
    """
    found = []
    for part in parts_of(region, strategy):
        distance = part.border_distance
        if distance is not None:
            at = max(strategy.edge_margin_m, _ON_EDGE * strategy.stepover_m)
            loops = level_lines(part.mesh, distance, np.array([at]))
            # The outer border is the loop around all others.
            loops.sort(key=lambda loop: -float(np.linalg.norm(np.ptp(loop.points, axis=0))))
            of_turn = [replace(loop, level=min(k, 1)) for k, loop in enumerate(loops)]
            found += _in_turn(region, part, of_turn, strategy)
    return checked(found, strategy)


def _in_turn(
    region: RegionMesh, part: Part, lines: list[MeshLine], strategy: Strategy
) -> list[SurfacePath]:
    """Lines as paths: level by level where the strategy says where they start, else so that ways
    are short."""
    if strategy.start not in ("outside", "inside"):
        return driven(region, part, lines, strategy)
    levels = sorted({line.level for line in lines})
    each = [[line for line in lines if line.level == level] for level in levels]
    return [path for same in each for path in driven(region, part, same, strategy)]


def ring_distance(part: Part) -> np.ndarray:
    """Distance (v,) from a part's border, or from one end where it has none, m."""
    if part.border_distance is not None:
        return part.border_distance
    height = (part.mesh.vertices - part.centre) @ part.axes[0]
    return distance_from(part.mesh, np.array([int(np.argmin(height))]))


def ring_lines(part: Part, strategy: Strategy) -> list[MeshLine]:
    """Level lines of the distance from the border, one after another as `rings_apart` has it."""
    closer = replace(strategy, origin_m=None, stepover_m=rings_apart(part, strategy))
    return lines_at(part, ring_distance(part), closer)


def rings_apart(part: Part, strategy: Strategy) -> float:
    """How far rings are apart, m: a stepover, or a little less where the outermost has corners."""
    stepover = strategy.stepover_m
    outermost = np.array([strategy.edge_margin_m + 0.5 * stepover])
    rings = level_lines(part.mesh, ring_distance(part), outermost)
    cornered = any(len(corners_of(ring.points, 0.5 * stepover, ring.closed)) for ring in rings)
    return _CORNERED * stepover if cornered else stepover
