"""`nrdf cell`: begin a cell file, and check one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tyro.conf import Positional

from nrdf.commands.console import console, errors, show, table
from nrdf.commands.options import File


def cell() -> dict[str, Callable[..., Any]]:
    """Begin the file of a cell (robot, tools, limits), or check it."""
    return {"new": new, "check": check}


def new(
    out: File = Path("cell.yaml"),
    knowledge: tuple[File, ...] = (),
    format: tuple[str, ...] = ("urscript",),
    name: str = "cell",
    overwrite: bool = False,
) -> None:
    """Begin a cell file, commented, to be filled in.

    Every field stands in it once with what it means. With --knowledge the tools that its processes
    name are in it; where they are on the flange is for you to say.

    Example: nrdf cell new --knowledge chair.yaml --format urscript rapid

    Args:
        out: File to write.
        knowledge: Knowledge files that the cell works by.
        format: Export formats of its controllers.
        name: What people call the cell.
        overwrite: Replace the file if there is one.
    """
    from nrdf.cell.file import new_cell, write_cell
    from nrdf.errors import OutputError
    from nrdf.export.registry import check_formats
    from nrdf.io.output import output_file

    check_formats(format)
    if out.exists() and not overwrite:
        raise OutputError(f"{out} exists; give another name, or --overwrite to replace it")
    with output_file(out, knowledge):
        write_cell(out, new_cell(knowledge, name, format, out.parent))
    console.print(
        f"wrote {out}\nnext: say in it where objects stand and where the tools are, then\n"
        f"nrdf cell check {out}"
    )


def check(file: Positional[File], without_robot: bool = False) -> None:
    """Show what a cell file says, and whether it is right.

    Fields, formats and their options, knowledge files and their tools are checked, and the robot is
    loaded. What is wrong is named by field and value, with exit code 2.

    Example: nrdf cell check cell.yaml

    Args:
        file: The cell file.
        without_robot: Do not load the robot's model, which needs MuJoCo.
    """
    from nrdf.cell.file import read_cell
    from nrdf.cell.rules import missing_tools, read_choices
    from nrdf.errors import ProcessError
    from nrdf.export.options import options_of_cell
    from nrdf.export.registry import check_formats
    from nrdf.io.model_file import listed

    said = read_cell(file)
    check_formats(said.programs.formats)
    options_of_cell(said)
    choices = read_choices(said, file.parent)
    if missing := missing_tools(said, choices):
        raise ProcessError(listed(str(file), missing))
    shown = table("", "tool", "TCP, mm", "number", "switched in", texts=1)
    for tool in said.tools:
        formats = [f for f in said.programs.formats if any(s.switches(f) for s in tool.switches)]
        tcp = " ".join(f"{1e3 * x:g}" for x in tool.tcp_m)
        number = str(said.tool_numbers[tool.name])
        shown.add_row(tool.name, tcp, number, ", ".join(formats) or "–")
    show(shown)
    for line in _not_switched(said, choices):
        errors.print(line, style="yellow")
    for choice in choices:
        names = ", ".join(choice.names) or f"every {choice.knowledge.category}"
        console.print(f"{choice.file.name}: {names}")
    if not without_robot:
        from nrdf.robot.model.arm import load_arm

        model = said.robot.model
        arm = load_arm(file.parent / model if model else None, said.robot.tool_frame)
        for line in arm.checked:
            console.print(line, style="dim")
    console.print(f"the cell '{said.name}': nothing is wrong")


def _not_switched(said: Any, choices: Any) -> list[str]:
    """Warnings about spindles that no program turns on."""
    tools = {tool.name: tool for tool in said.tools}
    lines: dict[str, None] = {}
    for choice in choices:
        for region in choice.knowledge.regions:
            for process in region.processes:
                if process.spindle_rad_s is None:
                    continue
                switches = [
                    s
                    for s in tools[process.tool.name].switches
                    if not s.kinds or process.kind in s.kinds
                ]
                for name in said.programs.formats:
                    able = name in ("urscript", "rapid", "krl")
                    if able and not any(switch.switches(name) for switch in switches):
                        lines[
                            f"tool '{process.tool.name}' has a spindle, which no {name} program "
                            f"switches for {process.kind}: give its switches outputs, or on and off"
                        ] = None
    return list(lines)
