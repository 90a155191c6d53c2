"""How a region is worked: the planner's settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from nrdf.errors import ProcessError, unknown_name

Trajectory = Literal["raster", "cross-hatch", "spiral", "contour"]
TRAJECTORIES: tuple[Trajectory, ...] = ("raster", "cross-hatch", "spiral", "contour")
_LEAST, _MOST = 1e-9, 1e6  # of every quantity: beyond, sums and squares are no longer numbers


@dataclass(frozen=True)
class Strategy:
    """How a region is worked: SI throughout.

    direction: (3,) main direction of the raster's lines in the surface's frame, projected to the
    surface; None for the region's longest extent. stepover_m: between neighbouring lines, along
    the surface; spacing_m: between waypoints, about; edge_margin_m: waypoints keep that far inside
    the region's border, and the footprint may reach over; tool_radius_m: of the footprint.
    clearance_m: that much must be free before the surface, along its normal, where it is worked.
    lead_rad: tilts the tool's tail towards the travel; tilt_rad: to the right of it; both 0: along
    the normal. standoff_m: from the tool centre point to the surface along the tool's axis.
    passes: the lines are driven that often, back and forth. Approach and retract: length of the
    free moves before and after a line, their angle from the normal (0: along the normal; pi/2:
    along the line), and their feed.
    """

    trajectory: Trajectory = "raster"
    direction: np.ndarray | None = None
    stepover_m: float = 0.02
    spacing_m: float = 0.01
    edge_margin_m: float = 0.0
    tool_radius_m: float = 0.025
    clearance_m: float = 0.0
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

    def __post_init__(self) -> None:
        if self.trajectory not in TRAJECTORIES:
            raise ProcessError(unknown_name("trajectory", self.trajectory, TRAJECTORIES))
        above = ("stepover_m", "spacing_m", "tool_radius_m", "feed_m_s", "approach_feed_m_s")
        for name in (*above, "retract_feed_m_s", "passes"):
            if not _LEAST <= getattr(self, name) <= _MOST:
                given = f"{name} is {getattr(self, name)}"
                raise ProcessError(f"{given}; give a value above 0 ({_LEAST:g} to {_MOST:g})")
        lengths = ("edge_margin_m", "clearance_m", "standoff_m", "approach_distance_m")
        for name in (*lengths, "retract_distance_m", "dwell_s"):
            if not 0.0 <= getattr(self, name) <= _MOST:
                raise ProcessError(
                    f"{name} is {getattr(self, name)}; give 0 or more, at most {_MOST:g}"
                )
        if self.direction is not None:
            direction = np.asarray(self.direction, dtype=np.float64)
            if direction.shape != (3,) or not 0.0 < np.linalg.norm(direction) < np.inf:
                raise ProcessError(f"direction is {self.direction}; give 3 numbers, not all 0")
