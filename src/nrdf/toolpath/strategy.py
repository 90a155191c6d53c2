"""How a region is worked: the settings of planner and modifiers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from nrdf.errors import ProcessError, unknown_name

Trajectory = Literal["raster", "plane-slices", "cross-hatch", "contour", "spiral", "edge", "rod"]
DirectionMode = Literal["taught", "fixed", "principal", "across"]
Start = Literal["near-left", "near-right", "far-left", "far-right", "outside", "inside"]
LineOrder = Literal["zigzag", "snake", "one-way", "nearest"]
Heading = Literal["travel", "fixed"]

TRAJECTORIES: tuple[Trajectory, ...] = get_args(Trajectory)
LARGEST_TURN_RAD_M = float(np.radians(3.0)) * 1e3
"""3° a mm."""
RESAMPLE_TURN_RAD = float(np.radians(5.0))
_LEAST, _MOST = 1e-9, 1e6  # of every quantity: beyond, sums and squares are no longer numbers
_NAMES = {
    "trajectory": Trajectory, "direction_mode": DirectionMode, "start": Start,
    "line_order": LineOrder, "heading": Heading,
}  # fmt: skip
_ABOVE_ZERO = (
    "stepover_m", "spacing_m", "tool_radius_m", "feed_m_s", "approach_feed_m_s",
    "retract_feed_m_s", "passes", "largest_turn_rad_m", "resample_turn_rad",
)  # fmt: skip
_AT_LEAST_ZERO = (
    "edge_margin_m", "clearance_m", "standoff_m", "approach_distance_m", "retract_distance_m",
    "dwell_s", "steady_m", "run_off_m", "run_off_height_m", "lead_in_radius_m", "lead_out_radius_m",
    "edge_contact_m", "chord_error_m", "resample_step_m", "minimum_length_m", "join_gap_m",
    "body_radius_m", "body_length_m",
)  # fmt: skip
_EITHER_SIGN = ("offset_m", "drag_m")


@dataclass(frozen=True)
class Strategy:
    """How a region is worked: SI throughout.

    trajectory: the planner's name in `nrdf.toolpath.planners.PLANNERS`.
    direction: (3,) main direction of the raster's lines in the surface's frame, projected to the
    surface; None for the region's longest extent. direction_mode: "taught" and "fixed" take it as
    it is; "principal" is the region's longest extent; "across" is square to what else it would be.
    start: where the first line begins: near or far along the lines' direction, left or right of it
    seen from outside; outside or inside of rings, edges and spirals, which are then driven from the
    outside in or from the inside out; None: wherever the planner begins. origin_m: (3,) of a place
    in the surface's frame that a line of a raster passes through, the others at whole stepovers
    from it; None: the lines lie evenly between the region's borders.
    line_order: "zigzag" joins lines on the surface, back and forth; "snake" lifts between them;
    "one-way" drives all in one direction; "nearest" goes on at the nearest end.
    stepover_m: between neighbouring lines, along the surface; spacing_m: between waypoints, about;
    edge_margin_m: waypoints keep that far inside the region's border, closed by the tool's radius
    (`nrdf.toolpath.closed_border`), and the footprint may reach over; tool_radius_m: of the
    footprint. clearance_m: that much must be free before the surface, along its normal, where it is
    worked. body_radius_m, body_length_m: of the tool's body, a cylinder that reaches back from the
    tool centre point, which planned paths keep off the object; a length of 0: not known.
    lead_rad: tilts the tool's tail towards the travel; tilt_rad: to the right of it; both 0: along
    the normal. heading: tool x along the travel, or along one direction. standoff_m: from the tool
    centre point to the surface along the tool's axis. offset_m: along the surface's normal,
    outward. drag_m: the tool's centre runs that far ahead of its contact; edge_contact_m: a tilted
    disc touches with its edge, that far from its centre.
    steady_m: normals are averaged that far to either side along a line, so that the axis turns
    steadily. run_off_m: lines go on that far beyond their ends, and rise run_off_height_m there.
    lead_in_radius_m, lead_out_radius_m: of the arcs on which the tool lands and leaves.
    largest_turn_rad_m: of the tool's axis, for each m of the way. chord_error_m: of the straight
    way between waypoints, 0 where they are evenly spaced. resample_step_m: waypoints are left out
    where straight steps up to that long stay within the chord error, and the tool turns by no more
    than resample_turn_rad over each; 0: none. minimum_length_m: shorter lines go where
    nothing is lost with them; None: the tool's radius. join_gap_m: the widest gap that is joined on
    the surface; None: three stepovers for a zigzag, else 0. constant_speed: the feed is that of the
    contact, not of the tool centre point.
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
    direction_mode: DirectionMode = "taught"
    start: Start | None = None
    origin_m: np.ndarray | None = None
    line_order: LineOrder = "zigzag"
    heading: Heading = "travel"
    steady_m: float = 0.0
    run_off_m: float = 0.0
    run_off_height_m: float = 0.0
    lead_in_radius_m: float = 0.0
    lead_out_radius_m: float = 0.0
    offset_m: float = 0.0
    drag_m: float = 0.0
    edge_contact_m: float = 0.0
    largest_turn_rad_m: float = LARGEST_TURN_RAD_M
    chord_error_m: float = 0.0
    resample_step_m: float = 0.0
    resample_turn_rad: float = RESAMPLE_TURN_RAD
    minimum_length_m: float | None = None
    join_gap_m: float | None = None
    constant_speed: bool = False
    body_radius_m: float = 0.0
    body_length_m: float = 0.0

    def __post_init__(self) -> None:
        for name, names in _NAMES.items():
            value, known = getattr(self, name), get_args(names)
            if value not in known and not (name == "start" and value is None):
                raise ProcessError(unknown_name(name.replace("_", " "), value, known))
        for name in _ABOVE_ZERO:
            if not _LEAST <= getattr(self, name) <= _MOST:
                given = f"{name} is {getattr(self, name)}"
                raise ProcessError(f"{given}; give a value above 0 ({_LEAST:g} to {_MOST:g})")
        for name in _AT_LEAST_ZERO:
            value = getattr(self, name)
            if value is not None and not 0.0 <= value <= _MOST:
                raise ProcessError(f"{name} is {value}; give 0 or more, at most {_MOST:g}")
        for name in _EITHER_SIGN:
            if not abs(getattr(self, name)) <= _MOST:
                raise ProcessError(f"{name} is {getattr(self, name)}; give at most {_MOST:g}")
        if self.direction is not None:
            direction = np.asarray(self.direction, dtype=np.float64)
            if direction.shape != (3,) or not 0.0 < np.linalg.norm(direction) < np.inf:
                raise ProcessError(f"direction is {self.direction}; give 3 numbers, not all 0")
        if self.origin_m is not None:
            origin = np.asarray(self.origin_m, dtype=np.float64)
            if origin.shape != (3,) or not np.abs(origin).max() <= _MOST:
                raise ProcessError(f"origin_m is {self.origin_m}; give 3 numbers, in metres")

    @property
    def in_rings(self) -> bool:
        """Whether lines are driven strictly from the outside in, or from the inside out."""
        return self.start in ("outside", "inside")

    @property
    def least_line_m(self) -> float:
        """Length below which a line goes if nothing is lost with it."""
        return self.tool_radius_m if self.minimum_length_m is None else self.minimum_length_m

    @property
    def joined_gap_m(self) -> float:
        """The widest gap between lines that is driven on the surface."""
        if self.join_gap_m is not None:
            return self.join_gap_m
        return 3.0 * self.stepover_m if self.line_order == "zigzag" else 0.0
