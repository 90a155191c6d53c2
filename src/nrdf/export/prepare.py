"""What every writer does first: choose what is written, turn its tools and check it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.export.options import Options, ToolZ
from nrdf.export.rotation import tool_z_out
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.types import Job, Segment, ToolPath, split_at_edges

_FARTHEST_M = 100.0
_SMALLEST_BLEND_M = 1e-4
_SAME = 1e-9


@dataclass(frozen=True)
class BlendedSegment:
    """A segment as a controller drives it.

    segment: without waypoints that repeat the one before; n may be 0. blends_m: (n,), how far
    before each waypoint the robot may begin to round it, 0 where it must arrive.
    """

    segment: Segment
    blends_m: np.ndarray


def prepare(job: Job, options: Options, tool_z: ToolZ) -> Job:
    """The part of `job` that is to be written, with the frame and tool names of the options.

    tool_z: where the format's tools point unless the options say otherwise. Paths of which nothing
    is left are left out.

    Raises ProcessError where nothing is left at all, and for positions that cannot be metres.
    """
    if not job.paths:
        raise ProcessError(
            "the job has no tool paths: no region was found or planned; its report says why"
        )
    paths = [_prepare_path(path, options, options.tool_z or tool_z) for path in job.paths]
    paths = [path for path in paths if path.segments]
    if not paths:
        kept = "process segments" if options.process_only else "waypoints"
        raise ProcessError(f"the job's tool paths have no {kept}; there is nothing to export")
    return replace(job, frame=options.frame or job.frame, paths=tuple(paths))


def _prepare_path(path: ToolPath, options: Options, tool_z: ToolZ) -> ToolPath:
    segments = []
    for segment in (part for whole in path.segments for part in split_at_edges(whole)):
        if len(segment.positions) == 0 or (options.process_only and segment.kind != "process"):
            continue
        farthest = float(np.abs(segment.positions).max())
        if farthest > _FARTHEST_M:
            raise ProcessError(
                f"a waypoint on region '{path.region}' has a coordinate of {farthest:.6g} m, more "
                f"than {_FARTHEST_M:g} m: positions in a job must be metres"
            )
        if tool_z == "out":
            turned = tool_z_out(segment.quaternions_xyzw)
            segment = replace(segment, quaternions_xyzw=turned)
        segments.append(segment)
    tcp = path.tcp_quaternion_xyzw
    if tcp is not None and tool_z == "out":
        tcp = tuple(tool_z_out(np.array([tcp]))[0].tolist())
    tool = options.tool or path.tool
    return replace(path, tool=tool, segments=tuple(segments), tcp_quaternion_xyzw=tcp)


def blended_segments(
    path: ToolPath, blend_m: float, stops: frozenset[int] = frozenset()
) -> list[BlendedSegment]:
    """The segments of `path` as a controller drives them, rounding waypoints by up to `blend_m`.

    A waypoint is not rounded at the path's ends, at a dwell, where the force changes, at the end of
    a segment whose index is in `stops`, or by more than 0.45 of the way to either neighbour.
    """
    counts = [len(segment.positions) for segment in path.segments]
    owner = np.repeat(np.arange(len(counts)), counts)
    positions = np.concatenate([segment.positions for segment in path.segments])
    quaternions = np.concatenate([segment.quaternions_xyzw for segment in path.segments])
    kept = np.ones(len(positions), bool)
    moved = step_lengths(positions) > _SAME
    # |q - q'| or |q + q'|: both signs are the same orientation.
    turned = np.minimum(
        np.abs(np.diff(quaternions, axis=0)).max(axis=1),
        np.abs(quaternions[1:] + quaternions[:-1]).max(axis=1),
    )
    kept[1:] = moved | (turned > _SAME)
    feeds = np.concatenate([segment.speeds_m_s for segment in path.segments])[kept]
    owner, positions, quaternions = owner[kept], positions[kept], quaternions[kept]
    step = np.linalg.norm(np.diff(positions, axis=0, prepend=positions[:1]), axis=1)
    blends = np.minimum(blend_m, 0.45 * np.minimum(step, np.append(step[1:], 0.0)))
    blends[blends < _SMALLEST_BLEND_M] = 0.0
    for i, segment in enumerate(path.segments):
        after = path.segments[i + 1] if i + 1 < len(path.segments) else None
        if i in stops or segment.dwell_s or not after or after.force_n != segment.force_n:
            blends[np.flatnonzero(owner <= i)[-1]] = 0.0
    made = []
    for i, segment in enumerate(path.segments):
        own = owner == i
        segment = replace(
            segment, positions=positions[own], quaternions_xyzw=quaternions[own],
            feeds_m_s=None if segment.feeds_m_s is None else feeds[own],
        )  # fmt: skip
        made.append(BlendedSegment(segment, blends[own]))
    return made


def tool_numbers(job: Job, options: Options) -> dict[str, int]:
    """Number of each tool, in the order in which they are first used."""
    names = dict.fromkeys(path.tool for path in job.paths)
    if options.cell is not None:
        numbers = options.cell.tool_numbers
        if set(names) <= set(numbers):
            return {name: numbers[name] for name in names}
    return {name: options.tool_number + i for i, name in enumerate(names)}
