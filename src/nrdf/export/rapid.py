"""RAPID for ABB robots: a module with a routine for each path."""

from __future__ import annotations

from pathlib import Path

from nrdf.errors import ProcessError
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
from nrdf.export.switching import Dialect, cell_tool, switching, switching_note
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
_SUPPORT_IN_CELL = "Spindle and gun are switched as the cell file says. Dwell is carried."
_COMMENTED_FORCE = "Contact force is not carried: it stands in comments."
_FC_PRESSURE = (
    "Contact force is carried by ABB's option Force Control: FCPress1LStart, FCPressL, FCPressEnd, "
    "force along tool z. Before it runs: FCCalib with the tool's load, and a look at the "
    "supervision."
)
_START_SHARE = 50
"""Percent of the force at which FCPress1LStart moves on."""
_DIALECT = Dialect(
    "rapid",
    lambda signal, on: f"SetDO {signal},{int(on)};",
    lambda seconds: f"WaitTime {number(seconds, 3)};",
    in_passing=True,
)
_LONGEST = 32
_REST = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.mod."""
    job = prepare(job, options, "into")
    name = program_name(job, options, _LONGEST - 4, "RAPID", _WORDS)
    in_cell = options.cell is not None
    frame = "wobj0" if in_cell and not options.frame else identifier(job.frame, _LONGEST)
    tools = identifiers(dict.fromkeys(p.tool for p in job.paths), _LONGEST, "RAPID")
    for path in job.paths:
        tool = cell_tool(path, options)
        if tool is not None and tool.controller_name:
            tools[path.tool] = tool.controller_name
    orientation = f"quaternion q1 q2 q3 q4 = w x y z; {tool_z_words(options, 'into')}."
    comments = header(
        job,
        options,
        "Lengths in mm, speeds in mm/s.",
        orientation,
        _support(options) if in_cell else _SUPPORT,
        f"Must exist in the controller: wobjdata {frame}; tooldata {', '.join(tools.values())}. "
        "The configuration is left to the controller (ConfL off). "
        f"{switching_note(job.paths, options, _DIALECT)}".strip(),
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


def _support(options: Options) -> str:
    """What becomes of force and spindle in a cell."""
    return f"{_FC_PRESSURE if _presses(options) else _COMMENTED_FORCE} {_SUPPORT_IN_CELL}"


def _presses(options: Options) -> bool:
    return options.cell is not None and "rapid" in options.cell.robot.force_control


def _path(path: ToolPath, options: Options, speeds: dict[str, str], how: str) -> list[str]:
    lines: list[str] = []
    switched = switching(path, options, _DIALECT)
    every = blended_segments(path, options.blend_mm / 1000, switched.stops)
    into = -1.0 if options.tool_z == "out" else 1.0
    arriving, pressing = True, False
    for i, blended in enumerate(every, start=1):
        segment = blended.segment
        lines += commented([segment_title(segment, i)], "! ")
        targets = [
            (target, zone, speeds[number(1000 * feed, 4)])
            for (target, zone), feed in zip(_targets(blended), segment.speeds_m_s, strict=True)
        ]
        if arriving and targets:
            target, zone, speed = targets.pop(0)
            lines.append(f"MoveJ {target},{speed},{zone},{how};")
            arriving = False
        lines += switched.before(i - 1)
        force = segment.force_n if _presses(options) else None
        for k, (target, zone, speed) in enumerate(targets, start=1):
            if k == len(targets) and i - 1 in switched.passing:
                signal, on = switched.passing[i - 1]
                lines.append(f"MoveLDO {target},{speed},{zone},{how},{signal},{int(on)};")
            elif force is None and pressing:
                lines.append(f"FCPressEnd {target},{speed},{how};")
                pressing = False
            elif force is None:
                lines.append(f"MoveL {target},{speed},{zone},{how};")
            elif not pressing:
                wanted = f"\\Fz:={number(into * force, 3)},{_START_SHARE}"
                frame = "\\ForceFrameRef:=FC_REFFRAME_TOOL"
                lines.append(f"FCPress1LStart {target},{speed},{wanted},{frame},{zone},{how};")
                pressing = True
            else:
                wanted = number(into * force, 3)
                lines.append(f"FCPressL {target},{speed},{wanted},{zone},{how};")
        if segment.dwell_s:
            lines.append(f"WaitTime {number(segment.dwell_s, 3)};")
        lines += switched.after(i - 1)
    if pressing:
        raise ProcessError(
            f"region '{path.region}', {path.process}: a path that ends on the surface has no move "
            "away on which force control could end; export it without --process-only"
        )
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
