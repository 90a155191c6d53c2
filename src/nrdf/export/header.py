"""What a file says about itself: unit, frame, tool, what it cannot carry, what is in it."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path

from nrdf.export.names import numbers, plain_text
from nrdf.export.options import Options, ToolZ
from nrdf.export.prepare import tool_numbers
from nrdf.io.atomic import write_atomically
from nrdf.toolpath.types import Job, Segment, ToolPath

TOOL_Z_WORDS = {
    "into": "tool z points into the part, tool x along the travel",
    "out": "tool z points out of the part, tool x along the travel",
}
_WARNING = (
    "The way to the first waypoint of each path is not checked for collisions, and no robot model "
    "was used: simulate the program before it runs."
)


def header(
    job: Job, options: Options, unit: str, orientation: str, support: str, notes: str = ""
) -> list[str]:
    """Sentences for the top of a file.

    unit: of positions and speeds. orientation: how it is written. support: what becomes of force,
    spindle and dwell. notes: what the user has to set.
    """
    lines = [
        f"Tool paths for a {plain_text(job.category)}, written by nrdf.",
        f"Frame: {plain_text(job.frame)}. Positions are those of the tool centre point. {unit}",
        _object_pose(job),
        f"Orientation: {orientation}",
        support,
        *([notes] if notes else []),
        _WARNING,
    ]
    numbers = tool_numbers(job, options)
    return lines + [
        f"{path_title(path, i)}, {_describe(path)}, tool {numbers[path.tool]}."
        for i, path in enumerate(job.paths, start=1)
    ]


def _object_pose(job: Job) -> str:
    """How the object lies in the frame."""
    if job.pose is None:
        return (
            "The job does not say how the object lies in the frame: taken to have +Y up and +X "
            "ahead."
        )
    up, ahead = (" ".join(numbers(axis, 4)) for axis in (job.up, job.forward))
    return f"In the frame, up for the object is {up}, ahead is {ahead}."


def tool_z_words(options: Options, tool_z: ToolZ) -> str:
    """Where the tool's axes point, `tool_z` unless the options say otherwise."""
    return TOOL_Z_WORDS[options.tool_z or tool_z]


def path_title(path: ToolPath, index: int) -> str:
    """Number, region, process and tool of a path."""
    process, tool = plain_text(path.process), plain_text(path.tool)
    return f"Path {index}: {plain_text(path.region)}, {process} with {tool}"


def _describe(path: ToolPath) -> str:
    """What the title leaves out."""
    text = f"radius {1000 * path.tool_radius_m:.3f} mm"
    if path.spindle_rad_s is not None:
        text += f", spindle {revolutions_per_minute(path.spindle_rad_s):.1f} rpm"
    if path.tcp_m is not None:
        text += f", TCP {' '.join(f'{1000 * x:.3f}' for x in path.tcp_m)} mm in the flange's frame"
    if path.force_tolerance_n is not None:
        text += f", force within {path.force_tolerance_n:.3f} N"
    waypoints = sum(len(segment.positions) for segment in path.segments)
    return text + f", segments: {len(path.segments)}, waypoints: {waypoints}"


def segment_title(segment: Segment, index: int) -> str:
    """Kind, line, speed and force of a segment."""
    force = "no contact force" if segment.force_n is None else f"force {segment.force_n:.3f} N"
    kind: str = segment.kind
    if segment.on_surface is not None and not segment.on_surface.any():
        kind += " off the surface"
    feed = f"{1000 * segment.feed_m_s:.3f} mm/s"
    if segment.feeds_m_s is not None:
        least, most = 1000 * segment.feeds_m_s.min(), 1000 * segment.feeds_m_s.max()
        feed = f"{least:.3f} to {most:.3f} mm/s"
    return f"Segment {index}: {kind}, line {segment.line}, {feed}, {force}"


def revolutions_per_minute(rad_s: float) -> float:
    return rad_s * 30.0 / math.pi


def commented(lines: list[str], before: str, after: str = "", width: int = 96) -> list[str]:
    """`lines` as comments of at most `width` characters each."""
    room = width - len(before) - len(after)
    return [before + part + after for line in lines for part in textwrap.wrap(line, room)]


def save(path: Path, lines: list[str], newline: str = "\n") -> Path:
    """Write lines of ASCII; the path."""
    write_atomically(path, ["".join(line + newline for line in lines).encode("ascii")])
    return path
