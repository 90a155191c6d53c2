"""`nrdf export`: the tool paths of a job as files for robots, machine tools and CAM."""

from __future__ import annotations

from typing import Annotated, Literal

from tyro.conf import Positional

from nrdf.commands.console import command_line, console, show, table, write_report
from nrdf.commands.options import File, Folder, Metavar

Name = Annotated[str, Metavar("NAME")]


def export(
    job: Positional[Folder],
    format: tuple[str, ...] = (),
    cell: File | None = None,
    out: Folder | None = None,
    program: Name | None = None,
    frame: Name | None = None,
    tool: Name | None = None,
    tool_z: Literal["into", "out"] | None = None,
    tool_number: int = 1,
    frame_number: int = 1,
    program_number: int = 1,
    process_only: bool = False,
    blend_mm: float = 1.0,
    acceleration_m_s2: Annotated[float | None, Metavar("M/S2")] = None,
    rotary: Literal["AC", "BC"] = "AC",
    tilt: Literal["positive", "negative"] = "positive",
    without_tcp_control: bool = False,
    overwrite: bool = False,
) -> None:
    """Write a job's tool paths for a robot, a machine tool or CAM.

    Formats: ros2-bag, noether, apt, gcode, urscript, rapid, krl, csv, json. Each gets a folder of
    its name in the output folder. What each carries, and how to load it: docs/guides/export.md.

    With --cell the programs are in the robot's base frame, with the cell's tools named and
    switched, and the formats are the cell's unless given. Nothing is written where a path is faster
    or presses harder than the cell allows, or enters a keep-out box.

    Example: nrdf export job-new/ --format urscript csv

    Args:
        job: Folder that `nrdf transfer` wrote, with toolpaths.json in it.
        format: One or more formats; with --cell, the cell's unless given.
        cell: Cell file, as `nrdf cell new` begins it.
        out: Folder to write; JOB/export unless given.
        program: The program's name, made to fit each controller's rules; nrdf_CATEGORY unless
            given.
        frame: Name of the positions' frame (work object, base); the job's unless given.
        tool: Name of the tool in the controller, for all paths; each path's own unless given.
        tool_z: Where tool z points, into or out of the part; out for noether, into for others
            unless given.
        tool_number: The first tool's number (apt, gcode, krl); further tools count up from it.
        frame_number: Number of the base (krl: BASE_DATA) or of the work offset (gcode: 1 to 6 are
            G54 to G59).
        program_number: Number of the program (gcode: O0001).
        process_only: Leave approach and retract out.
        blend_mm: How far from a waypoint a robot may round it (urscript, rapid, krl); 0: it stops
            at each.
        acceleration_m_s2: Acceleration of the tool centre point (urscript); 2, which feeds are
            planned with, unless given.
        rotary: Rotary axes of the machine tool (gcode).
        tilt: Sign of the A or B axis (gcode); either reaches every direction.
        without_tcp_control: The machine's own X Y Z instead of G43.4 (gcode); its two rotary tables
            meet in the origin.
        overwrite: Replace an earlier result in the output folder.
    """
    from nrdf.cell.file import read_cell
    from nrdf.cell.placement import place_job
    from nrdf.errors import ConfigError
    from nrdf.export.options import Options, options_of_cell
    from nrdf.export.registry import check_formats, export_job
    from nrdf.io.output import output_folder
    from nrdf.toolpath.file import read_toolpaths

    given = {
        "program": program,
        "frame": frame,
        "tool": tool,
        "tool_z": tool_z,
        "tool_number": tool_number,
        "frame_number": frame_number,
        "program_number": program_number,
        "process_only": process_only,
        "blend_mm": blend_mm,
        "rotary": rotary,
        "tilt": tilt,
        "without_tcp_control": without_tcp_control,
    }
    if acceleration_m_s2 is not None:
        given["acceleration_m_s2"] = acceleration_m_s2
    if cell is None:
        if not format:
            raise ConfigError("nrdf export needs --format, or --cell\nsee nrdf export --help")
        options = Options(**given)  # type: ignore[arg-type]
    else:
        for name, value in (("--tool", tool), ("--frame", frame)):
            if value is not None:
                raise ConfigError(f"{name} is what the cell file says; give one of the two")
        described = read_cell(cell)
        options = options_of_cell(described, **given)
        format = format or tuple(described.programs.formats)
    check_formats(format)
    content = read_toolpaths(job)
    home = job if job.is_dir() else job.parent
    if options.cell is not None:
        content = place_job(options.cell, content, home)
    folder_path = out or home / "export"
    with output_folder(folder_path, overwrite, [job, cell]) as folder:
        files = export_job(content, format, folder, options)
        said = {name: getattr(options, name) for name in given}
        report = {"command": command_line(), "job": str(job), "options": said}
        if cell is not None:
            report["cell"] = str(cell)
        write_report(folder, {**report, "formats": files})
    shown = table("", "format", "")
    for name, written in files.items():
        shown.add_row(name, ", ".join(written))
    show(shown)
    console.print(f"{len(content.paths)} tool paths written to {folder_path}")
