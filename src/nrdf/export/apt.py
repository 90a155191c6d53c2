"""APT source / CLDATA (ISO 4343): GOTO with tool axis, for post-processors and CAM."""

from __future__ import annotations

from pathlib import Path

from nrdf.export.header import (
    commented,
    header,
    path_title,
    revolutions_per_minute,
    save,
    segment_title,
)
from nrdf.export.names import number, numbers, program_name
from nrdf.export.options import Options
from nrdf.export.prepare import blended_segments, prepare, tool_numbers
from nrdf.export.rotation import tool_axes
from nrdf.export.switching import Dialect, switching, switching_note
from nrdf.toolpath.types import Job, Segment, ToolPath

_WIDTH = 72
_DIALECT = Dialect("apt", lambda signal, on: "", lambda seconds: f"DELAY/{number(seconds, 3)}")
_SUPPORT = (
    "Contact force is not carried: it stands in PPRINT lines. Nor is the tool's turn about its "
    "own axis. Spindle, feed and dwell are."
)


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.apt."""
    job = prepare(job, options, "into")
    name = program_name(job, options, 24, "the file system")
    axis = "i j k, the tool's axis from its tip to its holder, out of the part."
    comments = header(
        job,
        options,
        "Lengths in mm, feed in mm/min, DELAY in s.",
        axis,
        _SUPPORT,
        switching_note(job.paths, options, _DIALECT),
    )
    lines = [f"PARTNO/{name.upper()}", *commented(comments, "$$ ", width=_WIDTH)]
    lines += ["UNITS/MM", "MULTAX/ON"]
    numbers_of = tool_numbers(job, options)
    loaded = None
    for i, path in enumerate(job.paths, start=1):
        lines += commented([path_title(path, i).upper()], "PPRINT/", width=_WIDTH)
        if path.tool != loaded:
            lines.append(f"LOADTL/{numbers_of[path.tool]}")
            loaded = path.tool
        lines.append(f"CUTTER/{number(2000 * path.tool_radius_m, 4)}")
        lines += _path(path, options)
    save(folder / f"{name}.apt", [*lines, "END", "FINI"])


def _path(path: ToolPath, options: Options) -> list[str]:
    lines = []
    if path.spindle_rad_s is not None:
        rpm = number(revolutions_per_minute(path.spindle_rad_s), 2)
        lines.append(f"SPINDL/{rpm},RPM,CLW")
    arriving = True
    switched = switching(path, options, _DIALECT)
    for index, blended in enumerate(blended_segments(path, 0.0), start=1):
        segment = blended.segment
        lines += commented([segment_title(segment, index).upper()], "PPRINT/", width=_WIDTH)
        set_to = ""
        moves = list(zip(_gotos(segment), segment.speeds_m_s, strict=True))
        if arriving and moves:
            lines += ["RAPID", *moves.pop(0)[0]]
            arriving = False
        lines += switched.before(index - 1)
        for goto, feed in moves:
            if set_to != (set_to := number(60000 * feed, 3)):
                lines.append(f"FEDRAT/{set_to},MMPM")
            lines += goto
        if segment.dwell_s:
            lines.append(f"DELAY/{number(segment.dwell_s, 3)}")
        lines += switched.after(index - 1)
    return [*lines, "SPINDL/OFF"] if path.spindle_rad_s is not None else lines


def _gotos(segment: Segment) -> list[list[str]]:
    """A GOTO for each waypoint, continued with $ on a second line to keep to 72 columns."""
    if len(segment.positions) == 0:
        return []
    made = []
    axes = tool_axes(segment.quaternions_xyzw)
    for position, axis in zip(1000 * segment.positions, axes, strict=True):
        point, direction = ",".join(numbers(position, 5)), ",".join(numbers(axis, 9))
        made.append([f"GOTO/{point},$", direction])
    return made
