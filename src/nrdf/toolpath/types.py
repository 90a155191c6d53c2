"""What the whole program calls a tool path: waypoints, segments, tool paths, jobs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from nrdf.geometry.frames import z_axes
from nrdf.geometry.polylines import step_lengths
from nrdf.geometry.similarity import Similarity
from nrdf.toolpath.strategy import Strategy

ACCELERATION_M_S2 = 2.0
"""Of the tool centre point along lines: what feeds are planned with, and programs drive with,
unless given."""

SegmentKind = Literal["approach", "process", "transition", "retract"]


@dataclass(frozen=True)
class Waypoint:
    """One pose of the tool. position_m: (3,) of the tool centre point, in the job's frame;
    quaternion_xyzw: (4,) unit, rotation from the tool frame to the job's frame."""

    position_m: np.ndarray
    quaternion_xyzw: np.ndarray


@dataclass(frozen=True)
class Segment:
    """One stretch of a tool path.

    kind: "process" works on the surface; the others move freely: "approach" to a process segment,
        "retract" away from it, "transition" from one retract to the next approach.
    line: number, from 0, of the line of its path that the segment belongs to.
    positions: (n, 3) of the tool centre point, m, in the job's frame.
    quaternions_xyzw: (n, 4) unit, rotation from the tool frame to the job's frame. Tool z points
        along the tool's axis *into* the part, tool x along the travel, tool y completes a
        right-handed frame.
    feed_m_s: speed of the tool centre point. feeds_m_s: (n,) of the way to each waypoint, where it
        is not one feed all along; `feed_m_s` is then their mean over the way.
    force_n: contact force along tool z, at least 0, or None where nothing is touched.
    dwell_s: pause at the segment's last waypoint.
    on_surface: (n,) bool, where the tool is over the surface that it works; false where a process
        segment runs off the part, or turns beyond its edge without lifting. None: everywhere.
    tool_on: (n,) bool, where a gun is on; false where a process segment runs up to its speed before
        the gun goes on, and slows down after it. None: all along.
    """

    kind: SegmentKind
    line: int
    positions: np.ndarray
    quaternions_xyzw: np.ndarray
    feed_m_s: float
    force_n: float | None = None
    dwell_s: float = 0.0
    feeds_m_s: np.ndarray | None = None
    on_surface: np.ndarray | None = None
    tool_on: np.ndarray | None = None

    @property
    def applies(self) -> np.ndarray:
        """Whether (n,) the tool is on at each waypoint of a process segment; nowhere on free
        moves."""
        on = np.full(len(self.positions), self.kind == "process")
        return on if self.tool_on is None else on & self.tool_on

    @property
    def runs_up(self) -> bool:
        """Whether it is of a gun that goes on and off at speed."""
        return self.tool_on is not None and self.force_n is None

    @property
    def runs_up_at(self) -> np.ndarray:
        """Where (n,) it only runs up to its speed, or slows down, with its gun off."""
        return ~self.applies & self.runs_up

    @property
    def over_surface(self) -> np.ndarray:
        """Whether (n,) the tool is on and over the surface at each waypoint of a process segment;
        nowhere on free moves."""
        return self.applies if self.on_surface is None else self.applies & self.on_surface

    @property
    def speeds_m_s(self) -> np.ndarray:
        """Speed (n,) of the tool centre point on the way to each waypoint, m/s."""
        if self.feeds_m_s is not None:
            return self.feeds_m_s
        return np.full(len(self.positions), self.feed_m_s)

    @property
    def seconds(self) -> float:
        """Time on the way at these speeds, without the dwell."""
        return float((step_lengths(self.positions) / self.speeds_m_s[1:]).sum())

    @cached_property
    def axes(self) -> np.ndarray:
        """The tool's axes (n, 3), unit: tool z, into the part, in the job's frame."""
        return z_axes(self.quaternions_xyzw)

    def part(self, chosen: slice) -> Segment:
        """The segment of some of its waypoints."""

        def of(values: np.ndarray | None) -> np.ndarray | None:
            return None if values is None else values[chosen]

        return replace(
            self,
            positions=self.positions[chosen],
            quaternions_xyzw=self.quaternions_xyzw[chosen],
            feeds_m_s=of(self.feeds_m_s),
            on_surface=of(self.on_surface),
            tool_on=of(self.tool_on),
        )

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        """The segment's poses (n), in driving order."""
        pairs = zip(self.positions, self.quaternions_xyzw, strict=True)
        return tuple(Waypoint(position, quaternion) for position, quaternion in pairs)


@dataclass(frozen=True)
class SegmentGroup:
    """A process segment with the free moves right before and after it; None where there is none."""

    approach: Segment | None
    process: Segment
    retract: Segment | None


@dataclass(frozen=True)
class ToolPath:
    """All of one process step on one region.

    region: its name. process: the label of the process that made it ("sand", "paint 2", ...), which
    no other process on that region has. tool: the tool's name.
    tool_radius_m: radius of its footprint. spindle_rad_s: None where nothing turns.
    segments: in the order in which they are driven. parameters: free custom parameters.
    tcp_m, tcp_quaternion_xyzw: the tool frame in the robot's flange frame, None where not known.
    force_tolerance_n: how far the contact force may be off.
    strategy: the planner's settings that the path was made with, its direction in the job's frame;
    None for a path from a file of version 1 or 2.
    process_kind: what kind of process it is ("sand", "paint", ...); None in files before version 5.
    """

    region: str
    process: str
    tool: str
    tool_radius_m: float
    segments: tuple[Segment, ...]
    spindle_rad_s: float | None = None
    parameters: dict[str, Any] = field(default_factory=dict)
    tcp_m: tuple[float, float, float] | None = None
    tcp_quaternion_xyzw: tuple[float, float, float, float] | None = None
    force_tolerance_n: float | None = None
    strategy: Strategy | None = None
    process_kind: str | None = None

    @property
    def groups(self) -> tuple[SegmentGroup, ...]:
        """Every process segment, in driving order, with its approach and retract."""
        return group_segments(self.segments)


def split_at_edges(segment: Segment) -> list[Segment]:
    """A process segment as those on the surface and those off it, without force, in turn; where its
    tool is off, as approach and retract.

    A segment off the surface ends at the waypoint at which the tool is back on it; the next one
    begins there. One that is on the surface all along stays as it is.
    """
    there = segment.over_surface
    if segment.kind != "process" or there.all():
        return [segment]
    state = segment.applies.astype(int) + there
    cuts = np.flatnonzero(np.diff(state)) + 1
    starts, stops = [0, *cuts], [*cuts, len(there)]
    parts = []
    for start, stop in zip(starts, stops, strict=True):
        over = bool(there[start])
        last = stop == len(there)
        chosen = slice(start, stop if last or state[stop] < state[start] else stop + 1)
        kind: SegmentKind = "process"
        if not state[start]:
            kind = "approach" if not start else "retract"
        beyond = kind == "process" and not over
        parts.append(
            replace(
                segment.part(chosen),
                kind=kind,
                force_n=segment.force_n if over else None,
                dwell_s=segment.dwell_s if last else 0.0,
                on_surface=np.zeros(chosen.stop - chosen.start, bool) if beyond else None,
                tool_on=None,
            )
        )
    return parts


def group_segments(segments: Iterable[Segment]) -> tuple[SegmentGroup, ...]:
    """Every process segment with the approach right before it and the retract right after it."""
    around: list[Segment | None] = [None, *segments, None]
    return tuple(
        SegmentGroup(
            before if before is not None and before.kind == "approach" else None,
            segment,
            after if after is not None and after.kind == "retract" else None,
        )
        for before, segment, after in zip(around, around[1:], around[2:], strict=False)
        if segment is not None and segment.kind == "process"
    )


@dataclass(frozen=True)
class Job:
    """Tool paths for one object, in the order in which they are driven.

    category: what the object is. frame: name of the frame that positions are in (the target
    cloud's own). paths: in order. pose: of the object in that frame, from canonical coordinates (+X
    forward, +Y up, longest side 1), m; None in a job that does not say: an early file.
    """

    category: str
    frame: str
    paths: tuple[ToolPath, ...]
    pose: Similarity | None = None

    @property
    def up(self) -> np.ndarray:
        """The direction (3,) in the frame that is up for the object; +Y where the job does not say
        how it lies."""
        return np.eye(3)[1] if self.pose is None else self.pose.rotation[:, 1]

    @property
    def forward(self) -> np.ndarray:
        """The direction (3,) in the frame that the object faces; +X where the job does not say."""
        return np.eye(3)[0] if self.pose is None else self.pose.rotation[:, 0]
