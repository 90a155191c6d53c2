"""KRL for KUKA robots: a .src with a subprogram for each path, and its .dat."""

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
from nrdf.export.names import number, numbers, program_name, routine_names
from nrdf.export.options import Options
from nrdf.export.prepare import BlendedSegment, blended_segments, prepare, tool_numbers
from nrdf.export.rotation import kuka_abc_deg
from nrdf.export.switching import Dialect, switching, switching_note
from nrdf.toolpath.types import Job, ToolPath

_WORDS = (
    "and anin anout b_and b_exor b_not b_or bool brake case ccirc char circ circ_rel confirm const "
    "continue ctrl decl def default deffct defdat delay digin digout do else end enddat endfct "
    "endfor endif endloop endswitch endwhile enum exit ext exor extfct false for fct global goto "
    "halt if import int interrupt is lin lin_rel loop not or ptp ptp_rel public pulse real repeat "
    "resume return sec signal slin spline sptp step struc switch then to trigger true until wait "
    "while xor bas"
)
_LONGEST = 24
_SUPPORT = (
    "Contact force is not carried: it needs the option ForceTorqueControl, and stands in comments. "
    "Spindle speed is not either: switch it where a path begins. Dwell is."
)
_SUPPORT_IN_CELL = (
    "Contact force is carried only where the cell file has lines for an add-on (during: contact); "
    "else it stands in comments. Spindle and gun are switched as the cell file says. Dwell is "
    "carried."
)
_NOTES = (
    "Set before use: TOOL_DATA and BASE_DATA of the numbers in the .dat. Velocity in m/s "
    "($VEL.CP). Select the program in T1: the first motion is to where the robot stands."
)

_NOTES_IN_CELL = (
    "Positions are in the robot's base (BASE 0, where $ROBROOT is the world's). TOOL_DATA of "
    "the numbers in the .dat must be calibrated. Velocity in m/s ($VEL.CP). Select the program in "
    "T1: the first motion is to where the robot stands."
)
_DIALECT = Dialect(
    "krl",
    lambda signal, on: f"$OUT[{signal}]={'TRUE' if on else 'FALSE'}",
    lambda seconds: f"WAIT SEC {number(seconds, 3)}",
    in_passing=True,
)


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.src and PROGRAM.dat."""
    job = prepare(job, options, "into")
    name = program_name(job, options, _LONGEST, "KRL", _WORDS)
    orientation = f"A B C in degrees about Z, new Y, new X; {tool_z_words(options, 'into')}."
    in_cell = options.cell is not None
    support, notes = (_SUPPORT_IN_CELL, _NOTES_IN_CELL) if in_cell else (_SUPPORT, _NOTES)
    notes = f"{notes} {switching_note(job.paths, options, _DIALECT)}".strip()
    comments = header(job, options, "Lengths in mm.", orientation, support, notes)
    numbers_of = tool_numbers(job, options)
    constants = {tool: f"nrdf_tool_{n}" for tool, n in numbers_of.items()}
    procedures = routine_names(job, _LONGEST)
    lines = ["&ACCESS RVP", "&REL 1", f"DEF {name}( )", *commented(comments, "; ")]
    lines += [";FOLD INI", "BAS(#INITMOV,0)", ";ENDFOLD (INI)"]
    lines += ["BAS(#VEL_PTP,10)", "BAS(#BASE,nrdf_base)", "$APO.CDIS=nrdf_blend_mm"]
    lines += ["PTP $AXIS_ACT", *(f"{procedure}( )" for procedure in procedures), "END"]
    for i, (procedure, path) in enumerate(zip(procedures, job.paths, strict=True), start=1):
        lines += ["", f"DEF {procedure}( )", *commented([path_title(path, i)], "; ")]
        lines += [f"BAS(#TOOL,{constants[path.tool]})", *_path(path, options), "END"]
    save(folder / f"{name}.src", lines, "\r\n")
    data = ["&ACCESS RVP", "&REL 1", f"DEFDAT {name}", "EXT BAS(BAS_COMMAND :IN,REAL :IN )"]
    data += [f"DECL INT nrdf_base={0 if in_cell else options.frame_number}"]
    data += [f"DECL INT {constants[t]}={n}" for t, n in numbers_of.items()]
    data += [f"DECL REAL nrdf_blend_mm={number(options.blend_mm, 3)}", "ENDDAT"]
    save(folder / f"{name}.dat", data, "\r\n")


def _path(path: ToolPath, options: Options) -> list[str]:
    lines: list[str] = []
    arriving = True
    switched = switching(path, options, _DIALECT)
    every = blended_segments(path, options.blend_mm / 1000, switched.stops)
    for i, blended in enumerate(every, start=1):
        segment = blended.segment
        lines += commented([segment_title(segment, i)], "; ")
        set_to = ""
        moves = list(zip(_frames(blended), segment.speeds_m_s, strict=True))
        if arriving and moves:
            (frame, rounded), feed = moves.pop(0)
            set_to = number(feed, 6)
            lines += [f"$VEL.CP={set_to}", f"PTP {frame}{' C_DIS' if rounded else ''}"]
            arriving = False
        lines += switched.before(i - 1)
        for k, ((frame, rounded), feed) in enumerate(moves, start=1):
            if set_to != (set_to := number(feed, 6)):
                lines.append(f"$VEL.CP={set_to}")
            if k == len(moves) and i - 1 in switched.passing:
                output = _DIALECT.output(*switched.passing[i - 1])
                lines.append(f"TRIGGER WHEN DISTANCE=1 DELAY=0 DO {output}")
            lines.append(f"LIN {frame}{' C_DIS' if rounded else ''}")
        if segment.dwell_s:
            lines.append(f"WAIT SEC {number(segment.dwell_s, 3)}")
        lines += switched.after(i - 1)
    return lines


def _frames(blended: BlendedSegment) -> list[tuple[str, bool]]:
    """Frame of each waypoint, and whether the robot may round it."""
    if len(blended.segment.positions) == 0:
        return []
    made = []
    angles = kuka_abc_deg(blended.segment.quaternions_xyzw)
    for position, abc, blend in zip(
        1000 * blended.segment.positions, angles, blended.blends_m, strict=True
    ):
        values = zip("XYZABC", numbers(position, 5) + numbers(abc, 6), strict=True)
        made.append(("{" + ",".join(f"{key} {value}" for key, value in values) + "}", bool(blend)))
    return made
