"""URScript for Universal Robots: movel, with force_mode around contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nrdf.export.header import (
    commented,
    header,
    path_title,
    save,
    segment_title,
    tool_z_words,
)
from nrdf.export.names import number, numbers, plain_text, program_name, routine_names
from nrdf.export.options import Options
from nrdf.export.prepare import BlendedSegment, blended_segments, prepare
from nrdf.export.rotation import rotation_vectors
from nrdf.export.switching import Dialect, cell_tool, switching, switching_note
from nrdf.toolpath.types import Job, ToolPath

_WORDS = (
    "and break continue def elif else end false for global halt if in kill local loop movec movej "
    "movel movep not or p pause popup return run sleep stopj stopl sync textmsg thread true while "
    "xor force_mode end_force_mode zero_ftsensor pose_trans"
)
_SUPPORT = (
    "Contact force is carried: force_mode, compliant along tool z alone, from the first waypoint "
    "with force to the last. Spindle speed is not: switch it where a path begins. Dwell is."
)
_SUPPORT_IN_CELL = (
    "Contact force is carried: force_mode, compliant along tool z alone, from the first waypoint "
    "with force to the last. Dwell is. Spindle and gun are switched as the cell file says."
)
_NOTES = (
    "Set before use: nrdf_frame, the pose of the frame in the robot's base; TCP, payload and "
    "centre of gravity of the first tool in the installation, of others where the program stops "
    "for them. zero_ftsensor needs an e-Series or newer."
)
_NOTES_IN_CELL = (
    "Positions are in the robot's base: nothing to set but the speed of the joint moves. TCPs are "
    "set by the program, payloads where the cell file knows the mass. zero_ftsensor needs an "
    "e-Series or newer."
)
_DIALECT = Dialect(
    "urscript",
    lambda signal, on: f"set_standard_digital_out({signal}, {on})",
    lambda seconds: f"sleep({number(seconds, 3)})",
    in_passing=True,
)
_JOINT_SPEED = "a=0.5, v=0.3"


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.script."""
    job = prepare(job, options, "into")
    name = program_name(job, options, 32, "URScript", _WORDS)
    orientation = f"rotation vector rx ry rz in rad; {tool_z_words(options, 'into')}."
    in_cell = options.cell is not None
    support, notes = (_SUPPORT_IN_CELL, _NOTES_IN_CELL) if in_cell else (_SUPPORT, _NOTES)
    notes = f"{notes} {switching_note(job.paths, options, _DIALECT)}".strip()
    comments = header(job, options, "Lengths in m, speeds in m/s.", orientation, support, notes)
    procedures = routine_names(job, 32)
    lines = [*commented(comments, "# "), f"def {name}():", *_shared()]
    mounted = job.paths[0].tool
    for i, (procedure, path) in enumerate(zip(procedures, job.paths, strict=True), start=1):
        lines += [f"  def {procedure}():", *commented([path_title(path, i)], "    # ")]
        if path.tool != mounted:
            lines += _change_tool(path)
            mounted = path.tool
        lines += _set_tcp(path) + _set_payload(path, options)
        lines += [f"    {line}" for line in _path(path, options)] + ["  end"]
    save(folder / f"{name}.script", [*lines, *(f"  {p}()" for p in procedures), "end"])


def _shared() -> list[str]:
    """The frame to set, and a thread that turns the force's frame with the tool."""
    return [
        "  global nrdf_frame = p[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]",
        "  global nrdf_force_n = 0.0",
        "  thread nrdf_press():",
        "    while True:",
        "      force_mode(get_actual_tcp_pose(), [0, 0, 1, 0, 0, 0],"
        " [0.0, 0.0, nrdf_force_n, 0.0, 0.0, 0.0], 2, [0.05, 0.05, 0.05, 0.17, 0.17, 0.17])",
        "      sync()",
        "    end",
        "  end",
    ]


def _change_tool(path: ToolPath) -> list[str]:
    """A stop: a program cannot mount a second tool, or know its payload."""
    name = plain_text(path.tool)
    if path.tcp_m is not None:
        return [
            f"    # Unless it is set below, set the payload of {name} here: set_payload(...)",
            f'    popup("{name}: is it mounted?", title="nrdf", blocking=True)',
        ]
    return [
        f"    # Set the TCP and payload of {name} here: set_tcp(p[...]), set_payload(...)",
        f'    popup("{name}: is it mounted, and its TCP set?", title="nrdf", blocking=True)',
    ]


def _set_tcp(path: ToolPath) -> list[str]:
    """The tool centre point, where it is known."""
    if path.tcp_m is None:
        return []
    rotation = rotation_vectors(np.array(path.tcp_quaternion_xyzw or (0.0, 0.0, 0.0, 1.0)))
    values = ", ".join(numbers(path.tcp_m, 7) + numbers(rotation, 8))
    return [f"    set_tcp(p[{values}])"]


def _set_payload(path: ToolPath, options: Options) -> list[str]:
    """Mass and centre of mass, where the cell knows them."""
    tool = cell_tool(path, options)
    if tool is None or tool.mass_kg is None:
        return []
    centre = ", ".join(numbers(tool.centre_of_mass_m or (0.0, 0.0, 0.0), 5))
    return [f"    set_target_payload({number(tool.mass_kg, 4)}, [{centre}])"]


def _path(path: ToolPath, options: Options) -> list[str]:
    into = -1.0 if options.tool_z == "out" else 1.0
    lines: list[str] = []
    force: float | None = None
    arriving = True
    switched = switching(path, options, _DIALECT)
    every = blended_segments(path, options.blend_mm / 1000, switched.stops)
    for i, blended in enumerate(every, start=1):
        segment = blended.segment
        lines += commented([segment_title(segment, i)], "# ")
        moves = _moves(blended, options.acceleration_m_s2)
        if arriving and moves:
            pose = moves.pop(0)[0]
            lines.append(f"movej({pose}, {_JOINT_SPEED})")
            if segment.force_n is None and any(s.force_n is not None for s in path.segments):
                # Still in the air: what the sensor feels now is the tool's own weight.
                lines += ["sleep(0.2)", "zero_ftsensor()"]
            arriving = False
        lines += switched.before(i - 1)
        if segment.force_n != force:
            lines += _release() if force is not None else []
            lines += _press(into * segment.force_n) if segment.force_n is not None else []
            force = segment.force_n
        lines += [f"movel({pose}, {how})" for pose, how in moves]
        if i - 1 in switched.passing:  # the script goes on where the robot begins to round a place
            lines.append(_DIALECT.output(*switched.passing[i - 1]))
        if segment.dwell_s:
            lines.append(f"sleep({number(segment.dwell_s, 3)})")
        lines += switched.after(i - 1)
    return lines + (_release() if force is not None else [])


def _press(force_n: float) -> list[str]:
    return [f"nrdf_force_n = {number(force_n, 3)}", "nrdf_pressing = run nrdf_press()"]


def _release() -> list[str]:
    return ["kill nrdf_pressing", "end_force_mode()"]


def _moves(blended: BlendedSegment, acceleration_m_s2: float) -> list[tuple[str, str]]:
    """Pose and motion parameters of each waypoint."""
    if len(blended.segment.positions) == 0:
        return []
    acceleration = number(acceleration_m_s2, 3)
    rotations = rotation_vectors(blended.segment.quaternions_xyzw)
    made = []
    for position, rotation, feed, blend in zip(
        blended.segment.positions, rotations, blended.segment.speeds_m_s, blended.blends_m,
        strict=True,
    ):  # fmt: skip
        values = ", ".join(numbers(position, 7) + numbers(rotation, 8))
        how = f"a={acceleration}, v={number(feed, 5)}, r={number(float(blend), 5)}"
        made.append((f"pose_trans(nrdf_frame, p[{values}])", how))
    return made
