"""`nrdf export`: the tool paths of a job as files for robots, machine tools and CAM."""

from __future__ import annotations

from dataclasses import asdict

from tyro.conf import OmitArgPrefixes, Positional

from nrdf.commands.console import command_line, console, show, table, write_report
from nrdf.commands.options import Folder
from nrdf.export.options import Options


def export(
    job: Positional[Folder],
    format: tuple[str, ...],
    out: Folder | None = None,
    programs: OmitArgPrefixes[Options] = Options(),  # noqa: B008
    overwrite: bool = False,
) -> None:
    """Write a job's tool paths for a robot, a machine tool or CAM.

    Formats: ros2-bag, noether, apt, gcode, urscript, rapid, krl, csv, json. Each gets a folder of
    its name in the output folder. What each carries, and how to load it: docs/guides/export.md.

    Example: nrdf export job/ --format urscript csv --out programs/

    Args:
        job: Folder that `nrdf transfer` wrote, with toolpaths.json in it.
        format: One or more formats.
        out: Folder to write; JOB/export unless given.
        programs: Choices about what is written.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.export.registry import check_formats, export_job
    from nrdf.io.output import output_folder
    from nrdf.toolpath.file import read_toolpaths

    check_formats(format)
    content = read_toolpaths(job)
    place = out or (job if job.is_dir() else job.parent) / "export"
    with output_folder(place, overwrite, [job]) as folder:
        files = export_job(content, format, folder, programs)
        report = {"command": command_line(), "job": str(job), "options": asdict(programs)}
        write_report(folder, {**report, "formats": files})
    shown = table("", "format", "")
    for name, written in files.items():
        shown.add_row(name, ", ".join(written))
    show(shown)
    console.print(f"{len(content.paths)} tool paths written to {place}")
