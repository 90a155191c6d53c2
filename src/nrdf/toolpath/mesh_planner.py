"""From a strategy and a region of the object's mesh to the segments that a robot drives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.modifiers import join, order_nearest, smooth_orientation, split
from nrdf.toolpath.planner import add_approach_retract, tool_segments
from nrdf.toolpath.planners import PLANNERS, Planner
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath
from nrdf.toolpath.types import Segment

_LARGEST_STEP, _LARGEST_GAP = 2.0, 2.0  # spacings inside a line; stepovers that joined ones are


def plan_on_mesh(
    region: RegionMesh, strategy: Strategy, planner: Planner | None = None
) -> tuple[Segment, ...]:
    """Segments that work a region, in driving order; every contact is on the object's triangles.

    planner: the one of `nrdf.toolpath.planners.PLANNERS` that the strategy names, unless given.
    Raises ProcessError where it finds no line.
    """
    make = PLANNERS[strategy.trajectory] if planner is None else planner
    paths = within_limits(make(region, strategy), region, strategy)
    normals = [path.normals for path in paths]
    lines = tool_segments([path.contacts for path in paths], normals, strategy)
    return add_approach_retract(lines, normals, strategy)


def within_limits(
    paths: Sequence[SurfacePath], region: RegionMesh, strategy: Strategy
) -> list[SurfacePath]:
    """Paths without a step or turn above its limit, joined on the mesh, in a short order."""

    def project(
        points: np.ndarray, normals: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        found = region.mesh.nearest(points, normals)
        smooth = region.parent.smooth_normals(
            found.points, region.parent.nearest(found.points, found.normals).faces,
            strategy.tool_radius_m,
        )  # fmt: skip
        return found.points, smooth, found.distances < strategy.tool_radius_m

    step = _LARGEST_STEP * strategy.spacing_m
    steady = smooth_orientation(split(paths, step))
    gap = _LARGEST_GAP * strategy.stepover_m
    joined = join(order_nearest(steady), project, strategy.spacing_m, gap)
    return order_nearest(smooth_orientation(split(joined, step)))
