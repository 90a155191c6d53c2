"""Cell files: YAML, read with every fault named, and begun with comments."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from nrdf.cell.work_cell import VERSION, WorkCell
from nrdf.io.atomic import write_atomically
from nrdf.io.model_file import ModelFile
from nrdf.io.schema import Location
from nrdf.process.knowledge_file import read_knowledge
from nrdf.process.knowledge_text import model_lines

HEADER = """\
# A cell for nrdf: robot, tools and what switches them, where objects stand, limits.
# Quantities are SI; millimetres, degrees and rpm are understood as well: tcp_mm: [0, 0, 150] is
# tcp_m: [0, 0, 0.15]. Lines that begin with # are not set.
#   nrdf cell check FILE            shows what it says and whether it fits
#   nrdf export job --cell FILE     programs in the robot's base frame, tools named and switched
#   nrdf simulate job --cell FILE   with its pose, tools and keep-out boxes
#   nrdf run FILE inbox/            every scan that arrives becomes a checked program
# What a tool switches: an output, or lines of the controller's language, as for this spray gun.
#   switches:
#     - {during: line, kinds: [paint], outputs: {urscript: "2", rapid: doGun}, wait_on_s: 0.1,
#        on: {krl: ["PULSE_GUN(TRUE)"]}, off: {krl: ["PULSE_GUN(FALSE)"]}}
# A box to keep out of: {name: fence, centre_m: [0, -1.2, 1], size_m: [3, 0.1, 2]}
"""
_EXAMPLE_TCP_M = (0.0, 0.0, 0.15)


def _place(location: Location, content: dict[str, Any]) -> str:
    """Where in a cell file: "tools, 'gun': tcp_m"."""
    words = [str(part) for part in location]
    if len(location) >= 2 and isinstance(location[1], int):
        try:
            item = content[str(location[0])][location[1]]
            named = item.get("name", item.get("file"))
            words[1] = f"'{named}'" if isinstance(named, str) else str(location[1] + 1)
        except (KeyError, IndexError, TypeError, AttributeError):
            words[1] = str(location[1] + 1)
    return ".".join(words)


CELL_FILE = ModelFile(
    WorkCell, "cell", "nrdf cell new", "name: …, object: …, tools: …", VERSION, 1 << 24, _place
)
"""How cell files are read."""


def read_cell(path: str | Path) -> WorkCell:
    """The cell of a file. Raises ProcessError, as `ModelFile.read` does."""
    return CELL_FILE.read(path)


def new_cell(
    knowledge: Sequence[Path], name: str, formats: Sequence[str], folder: Path
) -> WorkCell:
    """A cell to fill in, for a file in `folder`: the tools that knowledge files name, at an example
    place. Raises ProcessError for a knowledge file that cannot be used."""
    import os

    tools: dict[str, dict[str, Any]] = {}
    rules = []
    for file in knowledge:
        said = read_knowledge(file)
        rules.append({"file": Path(os.path.relpath(file, folder)).as_posix()})
        for process in (process for region in said.regions for process in region.processes):
            tool = process.tool
            tcp = tool.tcp_m or _EXAMPLE_TCP_M
            tools.setdefault(tool.name, {"name": tool.name, "tcp_m": list(tcp)})
            if tool.tcp_quaternion_xyzw is not None:
                tools[tool.name]["tcp_quaternion_xyzw"] = list(tool.tcp_quaternion_xyzw)
    example = {"name": "tool", "tcp_m": list(_EXAMPLE_TCP_M)}
    content = {
        "name": name,
        "object": {"fixture_m": [0.8, 0.0, 0.0]},
        "tools": list(tools.values()) or [example],
        "programs": {"formats": list(formats)},
        "knowledge": rules,
    }
    return CELL_FILE.validated(content, "the new file")


def write_cell(path: Path, cell: WorkCell) -> None:
    """Write a cell file, every field once with what it means. Raises OutputError."""
    text = HEADER + "\n".join(model_lines(cell, explained=True)) + "\n"
    write_atomically(path, [text.encode()])
