"""Cell files that a browser sends, alone or in a ZIP archive with the robot's model and meshes."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from pathlib import Path, PurePath

from nrdf.cell.file import read_cell
from nrdf.cell.work_cell import WorkCell
from nrdf.errors import NrdfError, ProcessError
from nrdf.io.atomic import output_errors
from nrdf.io.output import output_folder
from nrdf.studio.model.uploads import LARGEST_UPLOAD, YAML, shown_name, too_large, unpack

CELL = "cell"
"""The folder in a session's that its cell is kept in."""
ENDINGS = (*YAML, ".zip")
_WANTED = "give a cell file, or one with the robot's model and meshes that it names"
_NAMED = re.compile(r"""(?:file|filename|dir)\s*=\s*["']([^"']*)["']""")
_LARGEST_MODEL = 1 << 24


def store_cell(name: str, content: bytes, place: Path) -> Path:
    """Keep a cell file that a browser sent, with what is in its archive, in the folder `place`,
    whole or not at all; the file.

    The robot's model is loaded where MuJoCo is there. Raises ProcessError for what is no cell file
    or names files that did not come with it, RobotError for a model that does not load, and
    OutputError where it cannot be written.
    """
    shown = shown_name(name)
    ending = PurePath(shown).suffix.lower()
    if ending not in ENDINGS:
        raise ProcessError(f"{shown} is no cell file: the name must end with {', '.join(ENDINGS)}")
    if len(content) > LARGEST_UPLOAD:
        raise ProcessError(too_large(shown, len(content)))
    with output_folder(place, overwrite=True) as folder:
        try:
            if ending == ".zip":
                unpack(name, content, folder, _WANTED, flat=False)
            else:
                with output_errors(folder):
                    (folder / f"cell{ending}").write_bytes(content)
            file, cell = cell_in(folder, shown)
            _check_robot(cell, file.parent, folder, shown)
        except NrdfError as error:
            raise type(error)(str(error).replace(f"{folder}{os.sep}", "")) from None
    return place / file.relative_to(folder)


def cell_in(folder: Path, shown: str) -> tuple[Path, WorkCell]:
    """The one cell file in a folder; others there may be knowledge files.

    Raises ProcessError where there is none, or there are several; shown: what is said to hold it.
    """
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in YAML)
    cells, faults = [], []
    for file in files:
        try:
            cells.append((file, read_cell(file)))
        except NrdfError as error:
            faults.append((file, error))
    if len(cells) == 1:
        return cells[0]
    if not cells and faults:
        named = [fault for file, fault in faults if "cell" in file.stem] or [faults[0][1]]
        raise named[0]
    raise ProcessError(f"{shown} holds {len(cells)} cell files (.yaml); {_WANTED}")


def _check_robot(cell: WorkCell, beside: Path, folder: Path, shown: str) -> None:
    """Load the robot's model. Nothing that it names may be outside of the folder."""
    model = cell.robot.model
    if model is not None:
        _check_inside(model, beside, folder, shown)
        file = beside / model
        if not file.is_file():
            raise ProcessError(
                f"{shown}: robot.model is '{model}', which did not come with it; send a ZIP of "
                "the cell file, that model and its meshes"
            )
    for path in folder.rglob("*"):
        if path.suffix.lower() in (".xml", ".urdf", ".mjcf") and path.is_file():
            if path.stat().st_size > _LARGEST_MODEL:
                raise ProcessError(f"{path} is larger than {_LARGEST_MODEL >> 20} MiB")
            for named in _NAMED.findall(path.read_text(errors="replace")):
                _check_inside(named.removeprefix("package://"), path.parent, folder, str(path))
    if find_spec("mujoco") is not None:
        from nrdf.robot.model.arm import load_arm

        load_arm(None if model is None else file, cell.robot.tool_frame)


def _check_inside(named: str, beside: Path, folder: Path, where: str) -> None:
    named = named.replace("\\", "/")
    ends = Path(os.path.normpath(beside / named))
    if "://" in named or ":" in named[:2] or not ends.is_relative_to(folder):
        raise ProcessError(
            f"{where} names '{shown_name(named)}', which is outside of what was sent; name files "
            "from the file's own folder"
        )
