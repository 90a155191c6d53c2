"""What a user chooses about exported programs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from nrdf.cell.work_cell import WorkCell
from nrdf.errors import ProcessError, unknown_name
from nrdf.toolpath.types import ACCELERATION_M_S2

ToolZ = Literal["into", "out"]


@dataclass(frozen=True)
class Options:
    """Choices for all formats; each uses those that concern it.

    Raises ProcessError, naming option and value, for a number out of range.
    """

    program: str | None = None
    """The program's name, made to fit each controller's rules; nrdf_CATEGORY unless given."""
    frame: str | None = None
    """Name of the positions' frame (work object, base); the job's unless given."""
    tool: str | None = None
    """Name of the tool in the controller, for all paths; each path's own unless given."""
    tool_z: ToolZ | None = None
    """Where tool z points, into or out of the part; out for noether, into for others if not given.
    """
    tool_number: int = 1
    """The first tool's number (apt, gcode, krl); further tools count up from it."""
    frame_number: int = 1
    """Number of the base (krl: BASE_DATA) or of the work offset (gcode: 1 to 6 are G54 to G59)."""
    program_number: int = 1
    """Number of the program (gcode: O0001)."""
    process_only: bool = False
    """Leave approach and retract out."""
    blend_mm: float = 1.0
    """How far from a waypoint a robot may round it (urscript, rapid, krl); 0: it stops at each."""
    acceleration_m_s2: float = ACCELERATION_M_S2
    """Acceleration of the tool centre point (urscript)."""
    rotary: Literal["AC", "BC"] = "AC"
    """Rotary axes of the machine tool (gcode)."""
    tilt: Literal["positive", "negative"] = "positive"
    """Sign of the A or B axis (gcode); either reaches every direction."""
    without_tcp_control: bool = False
    """The machine's own X Y Z instead of G43.4 (gcode); its two rotary tables meet in the origin.
    """

    cell: WorkCell | None = None
    """The cell that the job was placed in (`nrdf.cell.placement.job_in_base`): its tools are named,
    numbered and switched."""

    def __post_init__(self) -> None:
        _within("tool-number", self.tool_number, 1, 16)
        _within("frame-number", self.frame_number, 1, 32)
        _within("program-number", self.program_number, 1, 9999)
        _within("blend-mm", self.blend_mm, 0, 100)
        _within("acceleration-m-s2", self.acceleration_m_s2, 0.01, 20)


def _within(name: str, value: float, lowest: float, highest: float) -> None:
    if not lowest <= value <= highest:
        raise ProcessError(f"--{name} {value}: must be from {lowest} to {highest}")


def options_of_cell(cell: WorkCell, **given: Any) -> Options:
    """The options of a cell file's programs; `given`, where they are not the usual ones, instead.

    Raises ProcessError for an option that there is not, or a value that does not fit.
    """
    usual = Options()
    for name in cell.programs.options:
        if name not in vars(usual) or name in ("cell", "tool", "frame"):
            names = [one for one in vars(usual) if one not in ("cell", "tool", "frame")]
            raise ProcessError(
                f"the cell's programs.options: {unknown_name('option', name, names)}"
            )
    chosen = {name: value for name, value in given.items() if value != getattr(usual, name)}
    try:
        made = TypeAdapter(Options).validate_python({**cell.programs.options, **chosen})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"][:1]))
        raise ProcessError(f"the cell's programs.options: {where}: {first['msg']}") from None
    return replace(made, cell=cell)
