"""CSV: one row a waypoint, units in the columns' names, conventions in comments at the top."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from nrdf.export.header import commented, header, save, tool_z_words
from nrdf.export.names import plain_text, program_name
from nrdf.export.options import Options
from nrdf.export.prepare import prepare
from nrdf.io.file_names import spreadsheet_text
from nrdf.toolpath.types import Job

COLUMNS = (
    *("path", "region", "process", "tool", "tool_radius_m", "spindle_rad_s"),
    *("segment", "kind", "on_surface", "line", "feed_m_s", "force_n", "dwell_s"),
    *("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"),
)
_SUPPORT = (
    "Empty force_n: no contact. Empty spindle_rad_s: nothing turns. dwell_s: after the waypoint. "
    "A process segment with on_surface 0 is beyond the part's edge, the tool still on. "
    "Free parameters are not carried."
)


def write(job: Job, options: Options, folder: Path) -> None:
    """Write PROGRAM.csv."""
    job = prepare(job, options, "into")
    name = program_name(job, options, 64, "the file system")
    orientation = f"unit quaternion qx qy qz qw; {tool_z_words(options, 'into')}."
    lines = commented(header(job, options, "SI units.", orientation, _SUPPORT), "# ")
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(COLUMNS)
    for i, path in enumerate(job.paths, start=1):
        texts = (path.region, path.process, path.tool)
        names = [spreadsheet_text(plain_text(text)) for text in texts]
        whole = [i, *names, float(path.tool_radius_m), path.spindle_rad_s]
        for k, segment in enumerate(path.segments, start=1):
            over = int(segment.over_surface.all())
            about, feeds = [k, segment.kind, over, segment.line], segment.speeds_m_s.tolist()
            for n, position in enumerate(segment.positions, start=1):
                dwell = segment.dwell_s if n == len(segment.positions) else 0.0
                pose = [*position.tolist(), *segment.quaternions_xyzw[n - 1].tolist()]
                writer.writerow([*whole, *about, feeds[n - 1], segment.force_n, dwell, *pose])
    save(folder / f"{name}.csv", [*lines, *table.getvalue().splitlines()])
