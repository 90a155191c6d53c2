"""What a user chooses about exported programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from nrdf.errors import ProcessError

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
    acceleration_m_s2: float = 0.5
    """Acceleration of the tool centre point (urscript)."""
    rotary: Literal["AC", "BC"] = "AC"
    """Rotary axes of the machine tool (gcode)."""
    tilt: Literal["positive", "negative"] = "positive"
    """Sign of the A or B axis (gcode); either reaches every direction."""
    without_tcp_control: bool = False
    """The machine's own X Y Z instead of G43.4 (gcode); its two rotary tables meet in the origin.
    """

    def __post_init__(self) -> None:
        _within("tool-number", self.tool_number, 1, 16)
        _within("frame-number", self.frame_number, 1, 32)
        _within("program-number", self.program_number, 1, 9999)
        _within("blend-mm", self.blend_mm, 0, 100)
        _within("acceleration-m-s2", self.acceleration_m_s2, 0.01, 20)


def _within(name: str, value: float, lowest: float, highest: float) -> None:
    if not lowest <= value <= highest:
        raise ProcessError(f"--{name} {value}: must be from {lowest} to {highest}")
