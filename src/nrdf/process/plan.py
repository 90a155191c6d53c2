"""From a taught strategy and a region of a surface to the segments that a robot drives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from nrdf.process.surface import Surface
from nrdf.process.toolpath import Segment

Trajectory = Literal["raster", "cross-hatch", "spiral", "contour"]
TRAJECTORIES: tuple[Trajectory, ...] = ("raster", "cross-hatch", "spiral", "contour")


@dataclass(frozen=True)
class Strategy:
    """How a region is worked: SI throughout.

    direction: (3,) main direction of the raster's lines in the surface's frame, projected to the
    surface; None for the region's longest extent. stepover_m: between neighbouring lines;
    spacing_m: between waypoints; edge_margin_m: kept free inside the region's border;
    tool_radius_m: of the footprint. lead_rad: the tool axis leans by it about tool y, its tail
    towards where it travels; tilt_rad: the same about tool x, sideways; both 0 along the normal.
    standoff_m: the tool centre point's height over the surface. Approach and retract: distance
    of the free moves before and after a line, their angle from the normal (0: along the normal;
    pi/2: along the surface), and their feed.
    """

    trajectory: Trajectory = "raster"
    direction: np.ndarray | None = None
    stepover_m: float = 0.02
    spacing_m: float = 0.01
    edge_margin_m: float = 0.0
    tool_radius_m: float = 0.025
    lead_rad: float = 0.0
    tilt_rad: float = 0.0
    standoff_m: float = 0.0
    passes: int = 1
    feed_m_s: float = 0.1
    force_n: float | None = None
    dwell_s: float = 0.0
    approach_distance_m: float = 0.05
    approach_angle_rad: float = 0.0
    approach_feed_m_s: float = 0.25
    retract_distance_m: float = 0.05
    retract_angle_rad: float = 0.0
    retract_feed_m_s: float = 0.25


def plan(surface: Surface, region: np.ndarray, strategy: Strategy) -> tuple[Segment, ...]:
    """Segments that work `region`, indices (k,) of the surface's points, in driving order.

    Raises ProcessError for a margin that leaves nothing of the region, a stepover wider than it,
    or a value out of range.
    """
    raise NotImplementedError
