"""Plane slices: lines where parallel planes, one stepover apart, cut the region.

The planner that slicers have, and the rival of `nrdf.toolpath.planners.raster`.
"""

from __future__ import annotations

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part, checked, driven, lines_at, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine
from nrdf.toolpath.planners.raster import is_needed
from nrdf.toolpath.planners.sheet_lines import across_directions, line_direction, usual_length
from nrdf.toolpath.planners.sheets import sheets_of
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_BETTER = 2.0
"""How much longer the lines of another direction must be to be taken, on a closed part."""


def plan_plane_slices(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Lines of parallel planes, as slicers draw them: even in space, not along the surface.

    Every sheet of the region, as the top, underside and edges of a slab, is sliced by itself.
    Where the surface turns away from the planes' normal, lines are farther apart than the stepover;
    `nrdf.toolpath.planners.raster` keeps them even. Raises ProcessError as the raster does.
    """
    found: list[SurfacePath] = []
    for part in parts_of(region, strategy):
        for sheet in sheets_of(region, part, strategy):
            if is_needed(region, sheet, found, strategy):
                found += driven(region, sheet, _sliced(sheet, strategy), strategy)
    return checked(found, strategy)


def _sliced(part: Part, strategy: Strategy) -> list[MeshLine]:
    """Lines of one part, in the planes that stand on it, or along it where it closes around."""
    along = line_direction(part, strategy.direction)
    best: list[MeshLine] = []
    longest = 0.0
    for across in across_directions(part, along):
        lines = lines_at(part, part.mesh.vertices @ across, strategy)
        usual = usual_length(lines)

        if usual > _BETTER * longest:
            best, longest = lines, usual
    return best
