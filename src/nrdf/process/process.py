"""A process of the knowledge file: one thing that is done to a region, with its parameters."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from nrdf.process.quantities import (
    Angle,
    Direction,
    Name,
    NotNegative,
    Number,
    PlainMapping,
    PlausibleRange,
    Positive,
    Quantities,
    Quaternion,
    Vector,
    implausible,
)
from nrdf.process.result_keys import Amount, FeedLimitKeys
from nrdf.process.tool_keys import Tool
from nrdf.toolpath.strategy import (
    DirectionMode,
    Heading,
    LineOrder,
    Start,
)

Kind = Literal["sand", "polish", "oil", "paint", "clean", "inspect", "custom"]
Trajectory = Literal[
    "raster", "plane-slices", "cross-hatch", "contour", "spiral", "edge", "rod", "taught"
]
OriginMode = Literal["taught", "fixed"]
TransferMode = Literal["replan", "warp"]
WITHOUT_CONTACT = ("paint", "inspect")
"""Kinds of process that touch nothing, so have no contact force."""


_CORNERS = ("near-left", "near-right", "far-left", "far-right")
_RINGS = ("outside", "inside")
_STARTS: dict[str, tuple[str, ...]] = {
    "contour": _RINGS, "spiral": _RINGS, "edge": (*_CORNERS, *_RINGS),
}  # fmt: skip
_WITH_ORIGIN = ("raster", "plane-slices", "cross-hatch")
_FEED, _LENGTH = PlausibleRange(1e-4, 5.0), PlausibleRange(0.0, 1.0)
_SPACING = PlausibleRange(1e-4, 1.0)
_TILT = PlausibleRange(-math.pi / 3, math.pi / 3)


class FreeMove(Quantities):
    """The move to a line (approach) or away from it (retract)."""

    distance_m: Annotated[NotNegative, _LENGTH] = 0.05
    """Length of the move."""
    angle_rad: Annotated[Number, Field(ge=0, le=math.pi / 2)] = 0.0
    """Its angle from the surface's normal: 0 straight down, 90° along the surface."""
    feed_m_s: Annotated[Positive, _FEED] = 0.1
    """Its speed."""


class TaughtSegment(Quantities):
    """A taught process segment: one line of waypoints, in the order of travel."""

    positions_m: Annotated[list[Vector], Field(fail_fast=True)] = Field(min_length=1)
    """Tool centre points in the reference's frame."""
    quaternions_xyzw: Annotated[list[Quaternion], Field(fail_fast=True)] | None = None
    """Rotation from the tool frame (z into the part, x along the travel) to the reference's frame,
    one a waypoint; without them the tool follows the surface, lead and tilt."""

    @model_validator(mode="after")
    def _one_each(self) -> TaughtSegment:
        given = self.quaternions_xyzw
        if given is not None and len(given) != len(self.positions_m):
            raise ValueError(
                f"{len(given)} quaternions_xyzw do not fit {len(self.positions_m)} positions_m; "
                "give one a waypoint"
            )
        return self


class Process(Quantities):
    """One thing that is done to a region, with its parameters."""

    kind: Kind
    """sand, polish, oil, paint, clean, inspect or custom."""
    name: Name | None = None
    """What people call it ("sand, 120 grit"); needed where kind is custom."""
    order: Annotated[int, Field(ge=-(10**6), le=10**6)] = 0
    """Lower numbers first, over all regions; equal ones as they stand in the file."""
    transfer: TransferMode | None = None
    """replan: plan the strategy anew on the new object; warp: move every waypoint by the
    correspondence. Unless given, warp where the trajectory is taught, else replan."""
    trajectory: Trajectory = "raster"
    """raster, plane-slices, cross-hatch, contour, spiral, edge, rod (along a leg or a rail), or
    taught with its own waypoints."""
    direction: Direction | None = None
    """Along the lines of a raster, in the reference's frame; unless given, the longest way."""
    direction_mode: DirectionMode | None = None
    """taught: the direction, moved with the region to the new object; fixed: turned with the whole
    object only; principal: the region's longest way; across: square to that, or to the direction.
    Unless given, taught where there is a direction, else principal."""
    origin_m: Vector | None = None
    """A place, in the reference's frame, that a line of the raster passes through; the others lie
    at whole stepovers from it. Unless given, lines lie evenly between the region's borders."""
    origin_mode: OriginMode | None = None
    """taught: the origin, a point on the reference, moved with the region to the new object; fixed:
    any point, moved with the whole object only. Unless given, taught."""
    start: Start | None = None
    """Where the first line begins, seen from outside with the lines' direction ahead: near-left,
    near-right, far-left, far-right. outside: rings, edges and spirals from the outside in; inside:
    from the inside out, an outer border after its holes."""
    line_order: LineOrder | None = None
    """zigzag: back and forth, joined on the surface; snake: back and forth, lifted between lines;
    one-way: every line in the same direction; nearest: on to the nearest end. Unless given, snake
    for paint and inspect, else zigzag."""
    stepover_m: Annotated[Positive | None, _SPACING] = None
    """Distance between neighbouring lines, along the surface."""
    overlap: Annotated[Number, Field(ge=0, lt=1)] | None = None
    """Instead of the stepover: share of the footprint that neighbouring lines have in common."""
    spacing_m: Annotated[Positive, _SPACING] = 0.01
    """Distance between waypoints along a line."""
    edge_margin_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Kept free inside the region's border; gaps that the footprint does not fit into are none."""
    steady_m: Annotated[NotNegative, _LENGTH] = 0.0
    """The tool's axis follows the surface averaged that far to either side along a line."""
    run_off_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Lines go on that far beyond their ends, along the surface's tangent."""
    run_off_height_m: Annotated[NotNegative, _LENGTH] = 0.0
    """How far a line has risen from the surface at the end of its run-off."""
    lead_in_radius_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Radius of the arc on which the tool lands at a line's start; 0: none."""
    lead_out_radius_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Radius of the arc on which the tool leaves at a line's end; 0: none."""
    chord_error_m: Annotated[NotNegative, PlausibleRange(0.0, 0.1)] = 0.0
    """How far the straight way between two waypoints may be off the surface; more waypoints where
    it would be farther. 0: evenly spaced waypoints."""
    resample_step_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Longest step between waypoints where some are left out again: those between which the way is
    straight within chord_error_m, and the tool turns by less than resample_turn_rad. 0: none is
    left out."""
    resample_turn_rad: Annotated[Positive | None, PlausibleRange(1e-3, math.pi / 6)] = None
    """How far the tool may turn from one waypoint to the next where some are left out; unless
    given, 5°."""
    minimum_length_m: Annotated[NotNegative | None, _LENGTH] = None
    """Shorter lines are left out where nothing is lost with them; unless given, the tool's
    radius."""
    join_gap_m: Annotated[NotNegative | None, _LENGTH] = None
    """Lines whose ends are that near are joined on the surface; unless given, three stepovers for a
    zigzag, else 0."""
    passes: Annotated[int, Field(ge=1, le=1000), PlausibleRange(1, 100)] = 1
    """How often the region is worked."""
    tool: Tool
    """The tool."""
    lead_rad: Annotated[Angle, _TILT] = 0.0
    """Angle of the tool axis from the normal, in the direction of travel (its tail forward)."""
    tilt_rad: Annotated[Angle, _TILT] = 0.0
    """Angle of the tool axis from the normal, sideways."""
    heading: Heading = "travel"
    """travel: tool x follows the travel; fixed: it keeps to the lines' direction, so that the tool
    does not spin at turns."""
    largest_turn_rad_m: Annotated[Positive | None, PlausibleRange(1.0, 1000.0)] = None
    """How fast the tool's axis may turn along the way; sharper turns are smoothed, or the line is
    split there. Unless given, 3° a mm (largest_turn_deg_mm: 3)."""
    edge_contact_m: Annotated[NotNegative, _LENGTH] = 0.0
    """A tilted disc touches with its edge: distance of that from the tool centre point."""
    drag_m: Annotated[Number, PlausibleRange(-0.5, 0.5)] = 0.0
    """How far the tool centre point runs ahead of the contact, as of a brush that trails."""
    standoff_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Height of the tool centre point over the surface; 0 where the tool touches it."""
    offset_m: Annotated[Number, PlausibleRange(-0.1, 1.0)] = 0.0
    """Offset of the lines from the surface along its normal, outward: a coat's thickness, or below
    0 how far a soft pad is pressed in."""
    force_n: Annotated[Positive | None, PlausibleRange(0.01, 500.0)] = None
    """Contact force along the tool axis; leave it out where nothing is touched."""
    force_tolerance_n: Positive | None = None
    """How far the force may be off."""
    feed_m_s: Annotated[Positive, _FEED]
    """Speed of the tool centre point along the lines."""
    constant_speed: bool = False
    """Whether the feed is that of the contact instead: lines around bends are then driven faster or
    slower as a whole."""
    spindle_rad_s: Annotated[NotNegative | None, PlausibleRange(0.0, 100_000 * math.pi / 30)] = None
    """Speed of the spindle."""
    dwell_s: Annotated[NotNegative, PlausibleRange(0.0, 3600.0)] = 0.0
    """Pause at the end of each line."""
    approach: FreeMove = FreeMove()
    """The free move to a line."""
    retract: FreeMove = FreeMove()
    """The free move away from a line."""
    thickness_um: Amount | None = None
    """Film that is wanted, "60 ± 10"; stepover, run-off and feeds follow from it. Needs the tool's
    profile."""
    removal_um: Amount | None = None
    """Depth that is wanted, "30 ± 10"; stepover and feeds follow from it. Needs the tool's pad."""
    feed_limits: FeedLimitKeys = FeedLimitKeys()
    """What tool and robot can do, where feeds follow from the result."""
    waypoints: Annotated[list[TaughtSegment], Field(fail_fast=True)] | None = None
    """The lines of a taught trajectory."""
    allow_unusual: bool = False
    """Whether values beyond what is plausible (a feed above 5 m/s, say) are meant."""
    parameters: PlainMapping = Field(default={})
    """Anything else that the process needs, passed on as it is."""

    @property
    def label(self) -> str:
        """The process's own name, or its kind."""
        return self.name or self.kind

    @property
    def transfer_mode(self) -> TransferMode:
        """How it goes to a new object."""
        return self.transfer or ("warp" if self.trajectory == "taught" else "replan")

    @property
    def order_of_lines(self) -> LineOrder:
        """The order of its lines, given or that of its kind: what sprays or looks stops between
        lines, what touches stays on the surface."""
        return self.line_order or ("snake" if self.kind in WITHOUT_CONTACT else "zigzag")

    @property
    def distance_between_lines_m(self) -> float:
        """The stepover, given or from the overlap; the tool's radius for taught lines."""
        if self.stepover_m is not None:
            return self.stepover_m
        return 2 * self.tool.radius_m * (1 - (0.5 if self.overlap is None else self.overlap))

    @model_validator(mode="after")
    def _makes_sense(self) -> Process:
        if self.kind == "custom" and self.name is None:
            raise ValueError("kind is custom: give a name that says what is done")
        if self.stepover_m is not None and self.overlap is not None:
            raise ValueError("give stepover_m or overlap, not both")
        if self.trajectory == "taught":
            self._taught_makes_sense()
        elif self.waypoints is not None:
            raise ValueError(f"waypoints need trajectory: taught, not {self.trajectory}")
        elif self.stepover_m is None and self.overlap is None:
            raise ValueError(f"a {self.trajectory} needs stepover_m or overlap")
        self._direction_makes_sense()
        self._result_makes_sense()
        if self.force_n is not None:
            self._contact_makes_sense(self.force_n)
        elif self.force_tolerance_n is not None:
            raise ValueError("force_tolerance_n needs force_n")
        if not self.allow_unusual:
            self._is_plausible()
        return self

    def _is_plausible(self) -> None:
        lines = implausible(self)
        if self.stepover_m is None and self.overlap is not None:
            between = self.distance_between_lines_m
            fault = _SPACING.fault("stepover_m", between)
            lines += [f"with overlap {self.overlap:g}, {fault}"] if fault else []
        if lines:
            raise ValueError(
                "; ".join(lines) + ". Is the unit right? If it is meant, set allow_unusual: true "
                "in the process"
            )

    def _direction_makes_sense(self) -> None:
        mode = self.direction_mode
        if mode in ("taught", "fixed") and self.direction is None:
            raise ValueError(f"direction_mode {mode} needs a direction")
        if mode == "principal" and self.direction is not None:
            raise ValueError(
                "direction_mode principal is the region's longest way; remove the direction, or "
                "give direction_mode: taught"
            )
        starts = _STARTS.get(self.trajectory, _CORNERS)
        if self.start is not None and self.start not in starts:
            names = f"{', '.join(starts[:-1])} or {starts[-1]}"
            raise ValueError(f"start of a {self.trajectory} is {names}, not {self.start}")
        if self.origin_m is not None and self.trajectory not in _WITH_ORIGIN:
            raise ValueError(
                f"a {self.trajectory} has no origin_m; {', '.join(_WITH_ORIGIN[:-1])} and "
                f"{_WITH_ORIGIN[-1]} have"
            )
        if self.origin_mode is not None and self.origin_m is None:
            raise ValueError(f"origin_mode {self.origin_mode} needs origin_m")
        if self.resample_step_m > 0.0 and self.chord_error_m == 0.0:
            raise ValueError(
                "resample_step_m needs chord_error_m: how far the way may be off without the "
                "waypoints that are left out"
            )
        if self.edge_contact_m > 0.0 and self.lead_rad == self.tilt_rad == 0.0:
            raise ValueError("edge_contact_m needs lead_rad or tilt_rad: an upright disc lies flat")
        if self.run_off_height_m > 0.0 and self.run_off_m == 0.0:
            raise ValueError("run_off_height_m needs run_off_m")

    def _result_makes_sense(self) -> None:
        if self.thickness_um is not None and self.removal_um is not None:
            raise ValueError("give thickness_um or removal_um, not both")
        if self.thickness_um is not None:
            if self.tool.profile is None:
                raise ValueError("thickness_um needs tool.profile, of the spray gun")
            if self.standoff_m == 0.0:
                raise ValueError("thickness_um needs standoff_m, of the gun over the surface")
        if self.removal_um is not None and (self.tool.pad is None or self.force_n is None):
            raise ValueError("removal_um needs tool.pad and force_n")

    def _taught_makes_sense(self) -> None:
        if not self.waypoints:
            raise ValueError("trajectory is taught: give its waypoints, a list of lines")
        if self.transfer == "replan":
            raise ValueError(
                "transfer: replan needs a strategy to plan, but trajectory is taught; "
                "use transfer: warp"
            )

    def _contact_makes_sense(self, force_n: float) -> None:
        if self.kind in WITHOUT_CONTACT:
            raise ValueError(
                f"a force without contact: force_n is {force_n:g}, but kind {self.kind} touches "
                "nothing; remove force_n, or use kind: custom"
            )
        if self.standoff_m > 0:
            raise ValueError(
                f"a force without contact: force_n is {force_n:g}, but standoff_m is "
                f"{self.standoff_m:g}; set standoff_m to 0, or remove force_n"
            )
        if self.force_tolerance_n is not None and self.force_tolerance_n >= force_n:
            raise ValueError(
                f"force_tolerance_n is {self.force_tolerance_n:g}; it must be below force_n, "
                f"{force_n:g}, or contact may be lost"
            )
