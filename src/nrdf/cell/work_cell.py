"""The cell file's format: a robot, its tools, where objects stand, limits, and what a line does.

Quantities are SI, as in the knowledge file; millimetres, degrees and rpm are understood as well.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from nrdf.cell.tools import CellTool
from nrdf.process.limits import Limits
from nrdf.process.quantities import (
    Coordinate,
    FileName,
    Name,
    Number,
    PlausibleRange,
    Positive,
    Quantities,
    Quaternion,
    Vector,
    implausible,
)

VERSION: Final = 1
Share = Annotated[Number, Field(ge=0, le=1)]
Pattern = Annotated[str, Field(min_length=1, max_length=200)]
Row = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
_FARTHEST_M = 50.0
_ROUGHEST = 1e-3  # of a rotation's rows against unit vectors, as people round them


def _pose(rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
    """A rigid pose; says what is wrong with one that is not."""
    matrix = np.array(rows)
    rotation, position = matrix[:3, :3], matrix[:3, 3]
    if not np.allclose(matrix[3], [0, 0, 0, 1]):
        raise ValueError("the last row of a pose is [0, 0, 0, 1]")
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=_ROUGHEST):
        raise ValueError("its first three columns must be unit vectors at right angles")
    if np.linalg.det(rotation) < 0:
        raise ValueError("it is a left-handed frame, a mirror image: x cross y must be z, not -z")
    if np.abs(position).max() > _FARTHEST_M:
        raise ValueError(
            f"it is {np.abs(position).max():g} m from the base; poses are in metres, not mm"
        )
    return rows


Pose = Annotated[tuple[Row, Row, Row, Row], AfterValidator(_pose)]


class CellRobot(Quantities):
    """The robot, and what it may do."""

    model: FileName | None = None
    """URDF or MJCF, from the cell file's folder; the bundled arm unless given."""
    tool_frame: Name | None = None
    """Body or site of the model that tools are mounted on: the flange."""
    base_frame: Name = "base"
    """What the controller calls the frame of the robot's base."""
    floor_m: Annotated[Number, PlausibleRange(-5, 5)] = 0.0
    """Height of the floor in the base's frame: -0.6 where the base stands 0.6 m high."""
    max_feed_m_s: Annotated[Positive, PlausibleRange(1e-3, 10)] | None = None
    """No program moves a tool faster."""
    max_force_n: Annotated[Positive, PlausibleRange(0.1, 2000)] | None = None
    """No program presses harder."""
    force_control: dict[Literal["rapid"], Literal["fc-pressure"]] = Field(default={})
    """Options of the controller that carry contact force, by export format: rapid: fc-pressure is
    ABB's Force Control (FCPress1LStart, FCPressL, FCPressEnd). urscript always has force_mode;
    others can be switched by a tool's lines, during: contact."""


class ObjectPlace(Quantities):
    """Where an object stands, or how that is found. Give one of the two."""

    T_base_object: Pose | None = None
    """Pose of the frame that scans are in (the sensor's, after calibration) in the robot's base
    frame: four rows of a matrix, metres."""
    fixture_m: Vector | None = None
    """Instead: the middle of the underside of every object, in the base's frame, z up. The job says
    how the object lies in its scan."""
    facing_rad: Annotated[Number, PlausibleRange(-2 * math.pi, 2 * math.pi)] = 0.0
    """With fixture_m: where objects face, about the base's z, from its x."""

    @model_validator(mode="after")
    def _given_once(self) -> ObjectPlace:
        if (self.T_base_object is None) == (self.fixture_m is None):
            raise ValueError("give either T_base_object or fixture_m")
        return self


class KeepOutBox(Quantities):
    """A box that neither arm nor tool may enter."""

    name: Name
    """What stands there."""
    centre_m: Vector
    """Its middle, in the base's frame."""
    size_m: tuple[Positive, Positive, Positive]
    """Its whole lengths along its own axes."""
    quaternion_xyzw: Quaternion = (0.0, 0.0, 0.0, 1.0)
    """Rotation from its axes to the base's."""


class Programs(Quantities):
    """Which programs are written. Options as `nrdf export` has them."""

    formats: Annotated[list[str], Field(min_length=1, max_length=20)] = Field(default=["json"])
    """Export formats."""
    options: dict[str, Any] = Field(default={})
    """Options of `nrdf export`: blend_mm: 2, rotary: BC."""


class JobLimits(Quantities):
    """What a job must meet to be good, and what happens to one that does not."""

    min_coverage: Share | None = None
    """Least share of each whole region that its tool works."""
    max_line_spacing_m: Positive | None = None
    """Largest distance between neighbouring lines."""
    max_surface_distance_m: Positive | None = None
    """Largest distance of what is worked from the object as given."""
    max_axis_error_rad: Positive | None = None
    """Largest error of the tool's axis, of 99 % of the waypoints."""
    max_step_m: Positive | None = None
    """Largest step between neighbouring waypoints of a line."""
    max_turn_rad: Positive | None = None
    """Largest turn of the tool's axis between neighbouring waypoints of a line."""
    max_cycle_time_s: Positive | None = None
    """Longest time of all tool paths of an object together."""
    min_confidence: Share | None = None
    """Regions found with less mean confidence are skipped; 0.25 unless given."""
    require_all: bool = True
    """Whether every process of every region must have a tool path."""
    any_kind: bool = False
    """Whether an object that does not look like the knowledge's kind is taken."""
    strict: bool = True
    """Whether nothing may be doubtful about the object and its regions."""
    otherwise: Literal["look-at", "refused"] = "look-at"
    """Where a job goes that does not meet them: to be looked at, or refused."""

    @property
    def limits(self) -> Limits:
        """Those of `nrdf transfer`."""
        names = ("min_coverage", "max_line_spacing_m", "max_surface_distance_m",
                 "max_axis_error_rad", "max_step_m", "max_turn_rad", "max_cycle_time_s",
                 "require_all", "any_kind")  # fmt: skip
        return Limits(**{name: getattr(self, name) for name in names})


class KnowledgeRule(Quantities):
    """A knowledge file, and the objects that it is for."""

    file: FileName
    """Knowledge file, from the cell file's folder."""
    names: Annotated[list[Pattern], Field(max_length=50)] = Field(default=[])
    """Names of the objects' files, with * and ?: "chair-*". Unless given, files in a folder of the
    category's name (chair/17.ply), or that begin with it (chair-17.ply), and any file where this is
    the only knowledge."""


class Scans(Quantities):
    """How the objects' files are read."""

    up: Name | None = None
    """The files are scans, in which this points up (x, -z, auto, "0 0.1 1"): they are cleaned and
    aligned first. Unless given, objects stand as their reference: +X forward, +Y up."""
    unit: Literal["m", "cm", "mm", "in"] | None = None
    """Unit of files that do not say."""
    sensors: Annotated[list[Vector], Field(max_length=20)] = Field(default=[])
    """Where the scan's sensors stood, in the file's unit."""


class Line(Quantities):
    """How `nrdf run` and `nrdf serve` work."""

    workers: Annotated[int, Field(ge=1, le=256)] = 1
    """Worker processes."""
    settle_s: Annotated[Positive, PlausibleRange(0.05, 600)] = 1.0
    """A file has arrived when it has not changed for this long."""
    time_limit_s: Annotated[Positive, PlausibleRange(1, 86400)] = 600.0
    """A worker that takes longer over one object is ended, and the object refused."""
    memory_limit_mb: Annotated[int, Field(ge=256, le=10**7)] = 8000
    """A worker that needs more is ended, and the object refused."""
    simulate: bool = False
    """Whether each job is simulated on the arm as well; collisions and waypoints out of reach send
    it to look-at."""


class WorkCell(Quantities):
    """A cell: robot, tools, place of the objects, limits, and the line's own settings."""

    version: Literal[1] = VERSION
    """Version of this format."""
    name: Name
    """What people call the cell."""
    robot: CellRobot = CellRobot()
    """The robot."""
    object: ObjectPlace
    """Where the objects stand."""
    tools: Annotated[list[CellTool], Field(min_length=1, max_length=100)]
    """The tools."""
    keep_out: Annotated[list[KeepOutBox], Field(max_length=100)] = Field(default=[])
    """Boxes that neither arm nor tool may enter: fence, table, feeder."""
    programs: Programs = Programs()
    """What is written for the controller."""
    limits: JobLimits = JobLimits()
    """What a job must meet."""
    knowledge: Annotated[list[KnowledgeRule], Field(max_length=500)] = Field(default=[])
    """What is done on which objects; for `nrdf run` and `nrdf serve`."""
    scans: Scans = Scans()
    """How the objects' files are read."""
    line: Line = Line()
    """How `nrdf run` and `nrdf serve` work."""
    allow_unusual: bool = False
    """Whether values beyond what is plausible are meant."""

    @model_validator(mode="after")
    def _makes_sense(self) -> WorkCell:
        for what, names in (
            ("tools", [tool.name for tool in self.tools]),
            ("keep_out", [box.name for box in self.keep_out]),
        ):
            twice = next((name for name in names if names.count(name) > 1), None)
            if twice is not None:
                raise ValueError(f"two {what} are called '{twice}'; rename one")
        patterns = [(pattern, rule.file) for rule in self.knowledge for pattern in rule.names]
        for i, (pattern, file) in enumerate(patterns):
            for other, other_file in patterns[:i]:
                if pattern.casefold() == other.casefold() and file != other_file:
                    raise ValueError(
                        f"knowledge: {other_file} and {file} both claim objects named '{pattern}'; "
                        "an object needs one knowledge file"
                    )
        if not self.allow_unusual:
            self._is_plausible()
        return self

    def _is_plausible(self) -> None:
        lines = [*implausible(self)]
        for tool in self.tools:
            lines += implausible(tool, f"tool '{tool.name}': ")
            for switch in tool.switches:
                lines += implausible(switch, f"tool '{tool.name}': switches.")
        if lines:
            raise ValueError(
                "; ".join(lines) + ". Is the unit right? If it is meant, set allow_unusual: true"
            )

    @property
    def tool_numbers(self) -> dict[str, int]:
        """Number of each tool in the controller."""
        taken = {tool.number for tool in self.tools if tool.number is not None}
        free = iter(n for n in range(1, 2000) if n not in taken)
        return {t.name: t.number if t.number is not None else next(free) for t in self.tools}
