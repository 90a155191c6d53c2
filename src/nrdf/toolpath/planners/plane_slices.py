"""Plane slices: lines where parallel planes, one stepover apart, cut the region."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.polylines import total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part, checked, driven, lines_at, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine
from nrdf.toolpath.planners.raster import across_directions, line_direction
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath


def plan_plane_slices(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Lines of parallel planes, as slicers draw them: even in space, not along the surface.

    Where the surface turns away from the planes' normal, lines are farther apart than the stepover;
    `nrdf.toolpath.planners.raster` keeps them even. Raises ProcessError as the raster does.
    """
    found = []
    for part in parts_of(region, strategy):
        found += driven(region, part, _sliced(part, strategy), strategy)
    return checked(found, strategy)


def _sliced(part: Part, strategy: Strategy) -> list[MeshLine]:
    """Lines of one part, in the planes that stand on it, or along it where it closes around."""
    along = line_direction(part, strategy.direction)
    best: list[MeshLine] = []
    longest = -1.0
    for across in across_directions(part, along):
        lines = lines_at(part, part.mesh.vertices @ across, strategy)
        usual = float(np.median([total_length(line.points) for line in lines])) if lines else 0.0

        # The first direction is the likeliest: another must be clearly better.
        if usual > (2.0 if best else 1.0) * longest:
            best, longest = lines, usual
    return best
