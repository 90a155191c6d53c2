"""Process knowledge: on which regions of a reference object what is done, and how (paper, eq. 10).

The models here are the knowledge file's format; `nrdf.process.knowledge_file` reads and writes it.
Every quantity is SI and its name ends with its unit; a file may give millimetres, degrees and
revolutions per minute instead (``stepover_mm``, ``tilt_deg``, ``feed_mm_s``, ``spindle_rpm``).
Positions and directions are in the frame of the reference cloud.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

from pydantic import AfterValidator, Field, model_validator

from nrdf.io.file_names import clashing_names
from nrdf.process.quantities import (
    Angle,
    Direction,
    FileName,
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
from nrdf.regions.region import region_name_fault

VERSION: Final = 1
Kind = Literal["sand", "polish", "oil", "paint", "clean", "inspect", "custom"]
Trajectory = Literal["raster", "cross-hatch", "spiral", "contour", "taught"]
TransferMode = Literal["replan", "warp"]
_LONGEST_LABEL = 190  # characters of a name to which a number is added
WITHOUT_CONTACT = ("paint", "inspect")
"""Kinds of process that touch nothing, so have no contact force."""


_FEED, _LENGTH = PlausibleRange(1e-4, 5.0), PlausibleRange(0.0, 1.0)
_SPACING = PlausibleRange(1e-4, 1.0)
_TILT = PlausibleRange(-math.pi / 3, math.pi / 3)


def _region_name(text: str) -> str:
    if fault := region_name_fault(text):
        raise ValueError(f"no name for a region: {fault}")
    return text


class Tool(Quantities):
    """What touches or faces the surface."""

    name: Name = "tool"
    """Its name, for the robot's program."""
    radius_m: Annotated[Positive, PlausibleRange(1e-4, 0.5)]
    """Radius of its footprint on the surface."""
    clearance_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Free space that it needs above the surface, along the normal; planned paths leave out places
    that have less, such as crevices. 0: not checked."""
    tcp_m: Annotated[Vector | None, PlausibleRange(-2.0, 2.0)] = None
    """Tool centre point in the robot's flange frame."""
    tcp_quaternion_xyzw: Quaternion | None = None
    """Rotation from the tool frame (z into the part) to the flange frame."""


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
    """raster, cross-hatch, spiral, contour, or taught with its own waypoints."""
    direction: Direction | None = None
    """Along the lines of a raster, in the reference's frame; unless given, the longest way."""
    stepover_m: Annotated[Positive | None, _SPACING] = None
    """Distance between neighbouring lines, along the surface."""
    overlap: Annotated[Number, Field(ge=0, lt=1)] | None = None
    """Instead of the stepover: share of the footprint that neighbouring lines have in common."""
    spacing_m: Annotated[Positive, _SPACING] = 0.01
    """Distance between waypoints along a line."""
    edge_margin_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Kept free inside the region's border."""
    passes: Annotated[int, Field(ge=1, le=1000), PlausibleRange(1, 100)] = 1
    """How often the region is worked."""
    tool: Tool
    """The tool."""
    lead_rad: Annotated[Angle, _TILT] = 0.0
    """Angle of the tool axis from the normal, in the direction of travel (its tail forward)."""
    tilt_rad: Annotated[Angle, _TILT] = 0.0
    """Angle of the tool axis from the normal, sideways."""
    standoff_m: Annotated[NotNegative, _LENGTH] = 0.0
    """Height of the tool centre point over the surface; 0 where the tool touches it."""
    force_n: Annotated[Positive | None, PlausibleRange(0.01, 500.0)] = None
    """Contact force along the tool axis; leave it out where nothing is touched."""
    force_tolerance_n: Positive | None = None
    """How far the force may be off."""
    feed_m_s: Annotated[Positive, _FEED]
    """Speed of the tool centre point along the lines."""
    spindle_rad_s: Annotated[NotNegative | None, PlausibleRange(0.0, 100_000 * math.pi / 30)] = None
    """Speed of the spindle."""
    dwell_s: Annotated[NotNegative, PlausibleRange(0.0, 3600.0)] = 0.0
    """Pause at the end of each line."""
    approach: FreeMove = FreeMove()
    """The free move to a line."""
    retract: FreeMove = FreeMove()
    """The free move away from a line."""
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


Index = Annotated[int, Field(ge=0, lt=2**31)]


class Region(Quantities):
    """A region of the reference, given in one of four ways, and what is done to it."""

    name: Annotated[Name, Field(max_length=100), AfterValidator(_region_name)]
    """Its name."""
    file: FileName | None = None
    """Cloud of points that lie on the reference, or .npy, .npz of a mask, indices or points; from
    the knowledge file's folder; an .npz of several regions has this one under its name."""
    mask: Annotated[list[bool], Field(fail_fast=True)] | None = None
    """For each point of the reference whether it belongs to the region."""
    indices: Annotated[list[Index], Field(fail_fast=True)] | None = None
    """Which points of the reference belong to it, counted from 0."""
    points_m: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Points that lie on the reference, in its frame."""
    processes: list[Process] = Field(min_length=1, max_length=100)
    """What is done to it, one after another."""

    @property
    def steps(self) -> list[Process]:
        """The processes, each with a label of its own: where several have the same one, all but the
        first are named after it with a number, "sand 2"."""
        taken = {process.label for process in self.processes}
        seen: set[str] = set()
        made = []
        for process in self.processes:
            label = process.label
            if label in seen:
                names = (f"{process.label[:_LONGEST_LABEL]} {k}" for k in range(2, len(taken) + 3))
                label = next(name for name in names if name not in taken)
                process = process.model_copy(update={"name": label})
            seen.add(label)
            taken.add(label)
            made.append(process)
        return made

    @model_validator(mode="after")
    def _given_once(self) -> Region:
        ways = ("file", "mask", "indices", "points_m")
        given = [way for way in ways if getattr(self, way) is not None]
        if len(given) != 1:
            raise ValueError(
                f"give exactly one of {', '.join(ways)}; given: {', '.join(given) or 'none'}"
            )
        return self


class Reference(Quantities):
    """The object that the process was taught on: a file, or its points."""

    cloud: FileName | None = None
    """Cloud or mesh; from the knowledge file's folder."""
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    """Checksum of that file: regions are only right on the cloud that they were taught on."""
    unit: Literal["m", "cm", "mm", "in"] | None = None
    """Unit of the cloud's file, where it does not say."""
    frame: Name | None = None
    """Name of the cloud's coordinate frame, where its file does not say."""
    points_m: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Instead of a file: the points themselves."""
    normals: Annotated[list[Vector], Field(fail_fast=True)] | None = None
    """Outward unit normals of these points."""

    @model_validator(mode="after")
    def _given_once(self) -> Reference:
        if (self.cloud is None) == (self.points_m is None):
            raise ValueError("give either cloud (a file) or points_m")
        if self.points_m is not None and (self.sha256 or self.unit not in (None, "m")):
            raise ValueError("sha256 and unit belong to a cloud's file; points_m is in metres")
        if self.normals is not None and len(self.normals) != len(self.points_m or ()):
            raise ValueError("normals need points_m, one each")
        return self


class Knowledge(Quantities):
    """What was taught on one object, for other objects of its category."""

    version: Literal[1] = VERSION
    """Version of this format."""
    category: Name
    """What the object is: chair, car, plane, or what the model was trained on."""
    reference: Reference
    """The object that it was taught on."""
    allow_unusual: bool = False
    """Whether a category that no model is known for is meant; a process says so of its values."""
    allow_overlap: bool = False
    """Whether regions may have points in common."""
    regions: list[Region] = Field(min_length=1, max_length=500)
    """The process regions of interest (P-ROIs)."""
    origin: dict[str, Any] = Field(default={})
    """Where it comes from; written by transfer."""

    @model_validator(mode="after")
    def _distinct_names(self) -> Knowledge:
        names = [region.name for region in self.regions]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"two regions are called '{twice}'; rename one")
        if twins := clashing_names(names):
            raise ValueError(
                f"the regions '{twins[0]}' and '{twins[1]}' would be one file on Windows and "
                "macOS; rename one"
            )
        return self
