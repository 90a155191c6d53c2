"""RAPID for ABB robots: a module with a routine for each path."""

from __future__ import annotations

from pathlib import Path

from nrdf.export.header import (
    commented,
    header,
    path_title,
    save,
    segment_title,
    tool_z_words,
)
from nrdf.export.names import identifier, identifiers, number, numbers, program_name, routine_names
from nrdf.export.options import Options
from nrdf.export.prepare import BlendedSegment, blended_segments, prepare
from nrdf.geometry.frames import xyzw_to_wxyz
from nrdf.toolpath.types import Job, ToolPath

_WORDS = (
    "alias and backward case connect const default div do else elseif endfor endfunc endif "
    "endmodule endproc endrecord endtest endtrap endwhile error exit false for from func goto if "
    "inout local mod module nostepin not noview or pers proc raise readonly record retry return "
    "step sysmodule test then to trap true trynext undo var viewonly while with xor main"
)
_SUPPORT = (
    "Contact force is not carried: it needs the option Force Control, and stands in comments. "
    "Spindle speed is not either: switch it where a path begins. Dwell is."
)
_LONGEST = 32
_REST = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.mod."""
    job = prepare(job, options, "into")
    name = program_name(job, options, _LONGEST - 4, "RAPID", _WORDS)
    frame = identifier(job.frame, _LONGEST)
    tools = identifiers((path.tool for path in job.paths), _LONGEST, "RAPID")
    orientation = f"quaternion q1 q2 q3 q4 = w x y z; {tool_z_words(options, 'into')}."
    comments = header(
        job,
        options,
        "Lengths in mm, speeds in mm/s.",
        orientation,
        _SUPPORT,
        f"Must exist in the controller: wobjdata {frame}; tooldata {', '.join(tools.values())}. "
        "The configuration is left to the controller (ConfL off).",
    )
    feeds = (feed for path in job.paths for s in path.segments for feed in s.speeds_m_s)
    values = dict.fromkeys(number(1000 * feed, 4) for feed in feeds)
    speeds = {value: f"nrdf_v{i}" for i, value in enumerate(values, start=1)}
    procedures = routine_names(job, _LONGEST)
    # A module and a routine in it must not have one name.
    lines = [f"MODULE mod_{name}", *commented(comments, "  ! ")]
    for value, speed in speeds.items():
        lines.append(f"  LOCAL CONST speeddata {speed}:=[{value},500,5000,1000];")
    blend = number(options.blend_mm, 3)
    zone = f"[FALSE,{blend},{blend},{blend},1,{blend},1]"
    lines += [f"  LOCAL CONST zonedata nrdf_zone:={zone};", "", f"  PROC {name}()"]
    lines += ["    ConfJ\\Off;", "    ConfL\\Off;", *(f"    {p};" for p in procedures)]
    lines += ["    ConfL\\On;", "    ConfJ\\On;", "  ENDPROC"]
    for i, (procedure, path) in enumerate(zip(procedures, job.paths, strict=True), start=1):
        lines += ["", f"  LOCAL PROC {procedure}()", *commented([path_title(path, i)], "    ! ")]
        how = f"{tools[path.tool]}\\WObj:={frame}"
        lines += [f"    {line}" for line in _path(path, options, speeds, how)] + ["  ENDPROC"]
    save(folder / f"{name}.mod", [*lines, "ENDMODULE"], "\r\n")


def _path(path: ToolPath, options: Options, speeds: dict[str, str], how: str) -> list[str]:
    lines: list[str] = []
    arriving = True
    for i, blended in enumerate(blended_segments(path, options.blend_mm / 1000), start=1):
        segment = blended.segment
        lines += commented([segment_title(segment, i)], "! ")
        for (target, zone), feed in zip(_targets(blended), segment.speeds_m_s, strict=True):
            move = "MoveJ" if arriving else "MoveL"
            lines.append(f"{move} {target},{speeds[number(1000 * feed, 4)]},{zone},{how};")
            arriving = False
        if segment.dwell_s:
            lines.append(f"WaitTime {number(segment.dwell_s, 3)};")
    return lines


def _targets(blended: BlendedSegment) -> list[tuple[str, str]]:
    """Robtarget and zone of each waypoint."""
    quaternions = xyzw_to_wxyz(blended.segment.quaternions_xyzw)
    made = []
    for position, quaternion, blend in zip(
        1000 * blended.segment.positions, quaternions, blended.blends_m, strict=True
    ):
        values = f"[{','.join(numbers(position, 5))}],[{','.join(numbers(quaternion, 9))}]"
        made.append((f"[{values},{_REST}]", "nrdf_zone" if blend else "fine"))
    return made
