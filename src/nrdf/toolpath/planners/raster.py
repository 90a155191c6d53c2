"""Raster: lines of one direction, even along the surface, in snake order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import distance_across
from nrdf.toolpath.planners.field_lines import Part, checked, driven, lines_at, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

LEAST_IN_SURFACE = 0.2
"""A direction with a smaller share of its length along a region gives no direction there."""
_WHOLE, _BETTER = 0.9, 1.3
# Lines mostly shorter than that share of a part may run across what should be followed: the other
# way is taken where its lines are that much longer.


def plan_raster(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Lines at even distances along the surface from a middle line in the strategy's direction.

    The middle line is where a plane through the part's middle cuts it; all others are at even
    distances from it along the surface. Closed parts get lines all around. Raises ProcessError for
    a margin that leaves nothing, and a direction that stands on the region.
    """
    found = []
    for part in parts_of(region, strategy):
        found += driven(region, part, raster_lines(part, strategy), strategy)
    return checked(found, strategy)


def plan_cross_hatch(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """A raster, and a second one across it. Raises ProcessError as `plan_raster` does."""
    found, across = [], []
    for part in parts_of(region, strategy):
        found += driven(region, part, raster_lines(part, strategy), strategy)
        along = line_direction(part, strategy.direction)
        outward = part.axes[2] if part.outward is None else part.outward
        turned = replace(strategy, direction=np.cross(outward, along))
        across += driven(region, part, raster_lines(part, turned), turned)
    return checked(found + across, strategy)


def raster_lines(part: Part, strategy: Strategy) -> list[MeshLine]:
    """The lines of one part: of equal distance from its middle line."""
    along = line_direction(part, strategy.direction)
    best: list[MeshLine] = []
    longest = -1.0
    extent = float(np.ptp(part.mesh.vertices @ along))
    for across in across_directions(part, along):
        lines = lines_at(part, _across(part, across), strategy)
        usual = float(np.median([total_length(line.points) for line in lines])) if lines else 0.0
        if usual > _BETTER * longest:
            best, longest = lines, usual
        if usual >= _WHOLE * extent:
            break
    return best


def line_direction(part: Part, direction: np.ndarray | None) -> np.ndarray:
    """The unit direction (3,) of a part's lines: the one given, along it; or its longest extent.

    Raises ProcessError for one that stands on it.
    """
    if direction is None:
        along = part.axes[0]
    else:
        along = unit_vectors(np.asarray(direction, dtype=np.float64)[None])[0]
    if part.outward is None:
        return np.asarray(along)
    flat = along - (along @ part.outward) * part.outward
    length = float(np.linalg.norm(flat))
    if length >= LEAST_IN_SURFACE:
        return np.asarray(flat / length)
    if direction is None:
        return line_direction(part, part.axes[1])
    raise ProcessError(
        f"direction {np.asarray(direction).tolist()} stands on the region instead of running along "
        "it; give one along the surface, or none for the region's longest extent"
    )


def across_directions(part: Part, along: np.ndarray) -> list[np.ndarray]:
    """Directions (3,) across the lines, the likeliest first: one on an open part, two on a closed
    one."""
    if part.outward is not None:
        return [np.cross(part.outward, along)]
    away = part.mesh.centres - part.centre
    away = away - np.outer(away @ along, along)
    axes = np.linalg.eigh((away * part.mesh.areas[:, None]).T @ away)[1]
    return [axes[:, 2], axes[:, 1]]


def _across(part: Part, across: np.ndarray) -> np.ndarray:
    """Signed distance (v,) along the surface from the plane through a part's middle, m."""
    height = part.mesh.vertices @ across
    order = np.argsort(height)
    share = np.cumsum(part.mesh.mass[order])
    middle = float(np.interp(0.5 * share[-1], share, height[order]))
    return distance_across(part.mesh, height - middle)
