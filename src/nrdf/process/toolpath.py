"""Tool paths: what planning produces, reports judge, and exports write."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nrdf.errors import ProcessError
from nrdf.ply import write_atomically

VERSION = 1
FILE = "toolpaths.json"
SegmentKind = Literal["approach", "process", "departure"]
_LARGEST_FILE = 1 << 29


@dataclass(frozen=True)
class Segment:
    """One stretch of a tool path, driven at one speed.

    kind: "approach" and "departure" move freely, "process" works on the surface.
    line: number, from 0, of the line (stroke) of its path that the segment belongs to.
    positions: (n, 3) of the tool centre point, m, in the job's frame.
    quaternions_xyzw: (n, 4) unit, rotation from the tool frame to the job's frame. Tool z points
        along the tool's axis *into* the part, tool x along the travel, tool y completes a
        right-handed frame.
    feed_m_s: speed of the tool centre point.
    force_n: contact force along tool z, or None where nothing is touched.
    dwell_s: pause at the segment's last waypoint.
    """

    kind: SegmentKind
    line: int
    positions: np.ndarray
    quaternions_xyzw: np.ndarray
    feed_m_s: float
    force_n: float | None = None
    dwell_s: float = 0.0


@dataclass(frozen=True)
class ToolPath:
    """All of one process step on one region.

    region: its name. process: its kind ("sand", "paint", ...). tool: the tool's name.
    tool_radius_m: radius of its footprint. spindle_rad_s: None where nothing turns.
    segments: in the order in which they are driven. parameters: free custom parameters.
    """

    region: str
    process: str
    tool: str
    tool_radius_m: float
    segments: tuple[Segment, ...]
    spindle_rad_s: float | None = None
    parameters: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """Tool paths for one object, in the order in which they are driven.

    category: what the object is. frame: name of the frame that positions are in (the target
    cloud's own). paths: in order.
    """

    category: str
    frame: str
    paths: tuple[ToolPath, ...]
