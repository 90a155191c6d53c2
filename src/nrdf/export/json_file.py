"""JSON that says all there is, for programs of one's own."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from nrdf.export.header import header, save, tool_z_words
from nrdf.export.names import program_name
from nrdf.export.options import Options
from nrdf.export.prepare import prepare
from nrdf.export.switching import cell_tool
from nrdf.toolpath.file import pose_to_dict
from nrdf.toolpath.types import Job, ToolPath

VERSION = 1
_SUPPORT = (
    "force_n null: no contact. spindle_rad_s null: nothing turns. dwell_s: after the segment's "
    "last waypoint. on_surface false: beyond the part's edge, the tool still on."
)
WAYPOINT = ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.json."""
    job = prepare(job, options, "into")
    name = program_name(job, options, 64, "the file system")
    text = json.dumps(describe(job, options), indent=1, allow_nan=False)
    # A waypoint a line, not a number a line.
    text = re.sub(r"\[\n([-\d.e+,\s]+)\]", _on_one_line, text)
    save(folder / f"{name}.json", text.splitlines())


def _on_one_line(found: re.Match[str]) -> str:
    return "[" + " ".join(found[1].split()) + "]"


def _in_cell(path: ToolPath, options: Options) -> dict[str, Any]:
    """What the cell file says of a path's tool: number, mass, what is switched while it works."""
    tool = cell_tool(path, options)
    if options.cell is None or tool is None:
        return {}
    said = tool.model_dump(mode="json", exclude={"name", "tcp_m", "tcp_quaternion_xyzw"})
    return {"cell_tool": {**said, "number": options.cell.tool_numbers[tool.name]}}


def describe(job: Job, options: Options, waypoints: bool = True) -> dict[str, Any]:
    """All of a prepared `job` as JSON has it, the waypoints themselves if wanted."""
    orientation = f"unit quaternion qx qy qz qw; {tool_z_words(options, 'into')}."
    conventions = header(job, options, "SI units.", orientation, _SUPPORT)
    paths = []
    for path in job.paths:
        segments = []
        for segment in path.segments:
            feeds = segment.feeds_m_s
            over = {} if segment.on_surface is None else {"on_surface": False}
            poses = zip(segment.positions, segment.quaternions_xyzw, strict=True)
            segments.append(
                {
                    "kind": segment.kind,
                    **over,
                    "line": segment.line,
                    "feed_m_s": float(segment.feed_m_s),
                    **({} if feeds is None else {"feeds_m_s": feeds.tolist()}),
                    "force_n": segment.force_n,
                    "dwell_s": segment.dwell_s,
                    "waypoints": [[*p.tolist(), *q.tolist()] for p, q in poses]
                    if waypoints
                    else len(segment.positions),
                }
            )
        optional = ("tcp_m", "tcp_quaternion_xyzw", "force_tolerance_n")
        known = {n: getattr(path, n) for n in optional if getattr(path, n) is not None}
        paths.append(
            {
                "region": path.region,
                "process": path.process,
                "tool": path.tool,
                "tool_radius_m": float(path.tool_radius_m),
                "spindle_rad_s": path.spindle_rad_s,
                "parameters": path.parameters,
                **_in_cell(path, options),
                **known,
                "segments": segments,
            }
        )
    return {
        "format": "nrdf tool paths",
        "version": VERSION,
        "conventions": conventions,
        "category": job.category,
        "frame": job.frame,
        "pose": pose_to_dict(job.pose),
        "waypoint": list(WAYPOINT),
        "paths": paths,
    }
