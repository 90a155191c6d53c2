"""Planners: from a region of the target's mesh and a strategy to paths on the surface.

In: a `RegionMesh` and a `Strategy`. Out: `SurfacePath`s in driving order, every contact on a
triangle of the target. `PLANNERS` names them all.
"""

from __future__ import annotations

from collections.abc import Callable

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.contour import plan_contour, plan_edge
from nrdf.toolpath.planners.plane_slices import plan_plane_slices
from nrdf.toolpath.planners.raster import plan_cross_hatch, plan_raster
from nrdf.toolpath.planners.rod import plan_rod
from nrdf.toolpath.planners.spiral import plan_spiral
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

Planner = Callable[[RegionMesh, Strategy], list[SurfacePath]]

PLANNERS: dict[str, Planner] = {
    "raster": plan_raster,
    "plane-slices": plan_plane_slices,
    "cross-hatch": plan_cross_hatch,
    "contour": plan_contour,
    "spiral": plan_spiral,
    "edge": plan_edge,
    "rod": plan_rod,
}
