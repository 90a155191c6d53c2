"""Raster: lines of one direction, even along the surface, in snake order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import distance_across, even_share, signed_distance
from nrdf.toolpath.planners.field_lines import Part, checked, driven, lines_at, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine
from nrdf.toolpath.planners.missed_area import fill_missed_area
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

LEAST_IN_SURFACE = 0.2
"""A direction with a smaller share of its length along a region gives no direction there."""
_WHOLE, _BETTER = 0.9, 1.2
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
        found += driven(region, part, raster_lines(region, part, strategy), strategy)
    return checked(found, strategy)


def plan_cross_hatch(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """A raster, and a second one across it. Raises ProcessError as `plan_raster` does."""
    found, across = [], []
    for part in parts_of(region, strategy):
        found += driven(region, part, raster_lines(region, part, strategy), strategy)
        along = line_direction(part, strategy.direction)
        outward = part.axes[2] if part.outward is None else part.outward
        turned = replace(strategy, direction=np.cross(outward, along))
        across += driven(region, part, raster_lines(region, part, turned), turned)
    return checked(found + across, strategy)


def raster_lines(region: RegionMesh, part: Part, strategy: Strategy) -> list[MeshLine]:
    """The lines of one part: of equal distance from its middle line."""
    along = line_direction(part, strategy.direction)
    best: list[MeshLine] = []
    most, chosen = -1.0, np.zeros(0)
    extent = float(np.ptp(part.mesh.vertices @ along))
    for across in across_directions(part, along):
        height = _height(part, across)
        # Around a closed part the plane's lines are followed, around bends as well.
        ways = (
            (distance_across,) if part.outward is not None else (signed_distance, distance_across)
        )
        for way in ways:
            distance = way(part.mesh, height)
            lines = lines_at(part, distance, strategy)
            value = usual_length(lines) * even_share(part.mesh, distance)
            if value > _BETTER * most:
                best, most, chosen = lines, value, distance
            if value >= _WHOLE * extent:
                return fill_missed_area(region, part, distance, lines, strategy)
    return fill_missed_area(region, part, chosen, best, strategy)


def usual_length(lines: Sequence[MeshLine]) -> float:
    """Mean length of the line that a place of the lines is on, m: short pieces count little."""
    length = np.array([total_length(line.points) for line in lines])
    return float((length**2).sum() / max(float(length.sum()), 1e-300))


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


def _height(part: Part, across: np.ndarray) -> np.ndarray:
    """Signed height (v,) over the plane that halves a part's area, m."""
    height = part.mesh.vertices @ across
    order = np.argsort(height)
    share = np.cumsum(part.mesh.mass[order])
    return np.asarray(height - np.interp(0.5 * share[-1], share, height[order]))
