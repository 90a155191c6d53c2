"""ROS-Industrial Noether's tool paths as YAML, as its GUI saves them.

A file is a list of ToolPaths, here one a path of the job; ToolPaths are a list of ToolPath, here
one a line; a ToolPath is a list of segments, here what is driven without leaving the surface, with
its approach and retract as Noether's own modifiers add them; a segment is a list of waypoints, x,
y, z, qw, qx, qy, qz (noether_tpp/serialization.h).
"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from nrdf.export.header import (
    commented,
    header,
    path_title,
    save,
    segment_title,
    tool_z_words,
)
from nrdf.export.names import numbers, program_name
from nrdf.export.options import Options
from nrdf.export.prepare import prepare
from nrdf.toolpath.types import Job, Segment

_KEYS = ("x", "y", "z", "qx", "qy", "qz", "qw")
_SUPPORT = "Contact force, speed, spindle and dwell are not carried: they stand in comments."


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.yaml."""
    job = prepare(job, options, "out")
    name = program_name(job, options, 64, "the file system")
    orientation = f"unit quaternion; {tool_z_words(options, 'out')}."
    lines = commented(header(job, options, "Lengths in m.", orientation, _SUPPORT), "# ")
    for i, path in enumerate(job.paths, start=1):
        lines += ["-", *commented([path_title(path, i)], "  # ")]
        numbered = enumerate(path.segments, start=1)
        for line, of_line in groupby(numbered, key=lambda item: item[1].line):
            lines.append(f"  - # line {line}")
            for contact in _contacts(list(of_line)):
                lines.append("    -")
                for index, segment in contact:
                    lines += commented([segment_title(segment, index)], "      # ")
                    lines += _waypoints(segment)
    save(folder / f"{name}.yaml", lines)


def _contacts(segments: list[tuple[int, Segment]]) -> list[list[tuple[int, Segment]]]:
    """The segments of a line, those together between which the tool does not leave the surface."""
    made: list[list[tuple[int, Segment]]] = []
    before = "retract"
    for item in segments:
        kind = item[1].kind
        if before == "retract" or kind == "approach" or kind == before:
            made.append([])
        made[-1].append(item)
        before = kind
    return made


def _waypoints(segment: Segment) -> list[str]:
    made = []
    for position, quaternion in zip(segment.positions, segment.quaternions_xyzw, strict=True):
        values = numbers(position, 9) + numbers(quaternion, 12)
        pairs = (f"{key}: {value}" for key, value in zip(_KEYS, values, strict=True))
        made.append("      - {" + ", ".join(pairs) + "}")
    return made
