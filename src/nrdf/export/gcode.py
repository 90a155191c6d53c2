"""G-code (ISO 6983, Fanuc's dialect) for five-axis machine tools with an A/C or B/C pair."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
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
from nrdf.export.rotation import rotary_angles_deg, tool_axes
from nrdf.export.switching import Dialect, switching, switching_note
from nrdf.toolpath.types import Job, Segment, ToolPath

_SUPPORT = (
    "Contact force is not carried: it stands in comments. Nor is the tool's turn about its own "
    "axis. Spindle, feed and dwell are."
)
_WIDTH = 78
_DIALECT = Dialect("gcode", lambda signal, on: "", lambda seconds: f"G4 X{number(seconds, 3)}")


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.nc. Raises ProcessError for a work offset beyond G59."""
    if options.frame_number > 6:
        raise ProcessError(f"--frame-number {options.frame_number}: gcode has 1 to 6 (G54 to G59)")
    job = prepare(job, options, "into")
    name = program_name(job, options, 24, "the file system")
    unit = "Lengths in mm (G21), F in mm/min (G94), G4 X in s."
    notes = f"{_control(options)} {switching_note(job.paths, options, _DIALECT)}".strip()
    comments = header(job, options, unit, _orientation(options), _SUPPORT, notes)
    lines = ["%", f"O{options.program_number:04d} ({name.upper()})", *_comments(comments)]
    lines += ["G21 G90 G94 G17 G40 G49 G80", f"G{53 + options.frame_number}"]
    numbers_of = tool_numbers(job, options)
    loaded = None
    for i, path in enumerate(job.paths, start=1):
        lines += _comments([path_title(path, i)])
        # Up before anything turns or is changed: nobody has planned the way to the part.
        lines.append("G53 G0 Z0.0")
        tool = numbers_of[path.tool]
        if tool != loaded:
            lines.append(f"T{tool} M6")
            loaded = tool
        lines += _path(path, options, tool)
    save(folder / f"{name}.nc", [*lines, "G53 G0 Z0.0", "M30", "%"])


def _orientation(options: Options) -> str:
    first = options.rotary[0]
    about = "X" if first == "A" else "Y"
    return (
        f"{first} and C in degrees, counted as the tool moves in relation to the part (ISO 841): "
        f"tool axis, tip to holder = Rz(C) R{about.lower()}({first}) z, {first} turning about "
        f"{about}; {first} is {options.tilt}; C is not limited to one turn."
    )


def _control(options: Options) -> str:
    if options.without_tcp_control:
        return (
            "X Y Z are those of the machine's axes for two rotary tables, C on "
            f"{options.rotary[0]}; the work offset must be where their axes meet. Without G43.4, "
            "feeds and the lines between waypoints are approximate."
        )
    return "G43.4: X Y Z are those of the tool's tip on the part, at any angle."


def _comments(lines: list[str]) -> list[str]:
    # Old controls know capitals alone, and a bracket would end the comment.
    plain = [line.upper().replace("(", "[").replace(")", "]") for line in lines]
    return commented(plain, "(", ")", _WIDTH)


def _path(path: ToolPath, options: Options, tool: int) -> list[str]:
    segments = [blended.segment for blended in blended_segments(path, 0.0)]
    words = _words(segments, options)
    lines = []
    if path.spindle_rad_s is not None:
        lines.append(f"S{revolutions_per_minute(path.spindle_rad_s):.0f} M3")
    offset = "G43" if options.without_tcp_control else "G43.4"
    lines += [f"G0 {words[0][1]}", f"{offset} H{tool}"]
    row = 0
    switched = switching(path, options, _DIALECT)
    for index, segment in enumerate(segments, start=1):
        lines += _comments([segment_title(segment, index)])
        set_to = ""
        moves = list(zip(words[row:], segment.speeds_m_s, strict=False))
        if row == 0 and moves:
            lines.append("G0 {} {}".format(*moves.pop(0)[0]))
        lines += switched.before(index - 1)
        for (point, angles), speed in moves:
            same = set_to == (set_to := number(60000 * speed, 2))
            lines.append(f"G1 {point} {angles}" + ("" if same else f" F{set_to}"))
        row += len(segment.positions)
        if segment.dwell_s:
            lines.append(f"G4 X{number(segment.dwell_s, 3)}")
        lines += switched.after(index - 1)
    return [*lines, "G49", *(["M5"] if path.spindle_rad_s is not None else [])]


def _words(segments: list[Segment], options: Options) -> list[tuple[str, str]]:
    """X Y Z and the two angles of each waypoint of a path; C goes on from segment to segment."""
    positions = 1000 * np.concatenate([segment.positions for segment in segments])
    axes = tool_axes(np.concatenate([segment.quaternions_xyzw for segment in segments]))
    angles = rotary_angles_deg(axes, options.rotary, options.tilt)
    if options.without_tcp_control:
        positions = on_tables(positions, angles, options.rotary)
    return [
        (_joined("XYZ", numbers(position, 4)), _joined(options.rotary, numbers(pair, 5)))
        for position, pair in zip(positions, angles, strict=True)
    ]


def _joined(letters: str, values: list[str]) -> str:
    return " ".join(letter + value for letter, value in zip(letters, values, strict=True))


def on_tables(positions: np.ndarray, angles_deg: np.ndarray, rotary: str) -> np.ndarray:
    """Where points (n, 3) of the part are after its tables have turned to angles (n, 2).

    The tables' axes meet in the origin, and the C table stands on the other: the inverse of
    Rz(C) Rx(A) or Rz(C) Ry(B).
    """
    order = "ZX" if rotary == "AC" else "ZY"
    rotation = Rotation.from_euler(order, angles_deg[:, ::-1], degrees=True)
    return rotation.inv().apply(positions)
