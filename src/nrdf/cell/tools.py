"""A cell's tools: where their centre points are, what they weigh, and what switches them.

Lines of a controller's own language are copied into its programs as they stand, so a cell file is
as trusted as a program is. They must be single lines of printable ASCII.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from nrdf.process.process import Kind
from nrdf.process.quantities import (
    Name,
    NotNegative,
    PlausibleRange,
    Quantities,
    Quaternion,
    Vector,
)

SwitchedFormat = Literal["urscript", "rapid", "krl", "gcode", "apt"]
"""Export formats whose programs can switch something."""
PLACEHOLDERS = ("rpm", "force_n", "feed_mm_s")
"""What a switch's lines may name in braces: {rpm} is the spindle speed of the process."""
_SIGNALS = {
    "urscript": (r"[0-7]", "a standard digital output, 0 to 7"),
    "rapid": (r"[A-Za-z][A-Za-z0-9_]{0,31}", "the name of a digital output signal"),
    "krl": (r"[1-9][0-9]{0,3}", "the number of an output, 1 to 9999"),
}


def _line(text: str) -> str:
    if not text.strip() or not text.isascii() or not text.isprintable():
        raise ValueError("a program's line needs printable ASCII characters, and no line break")
    for name in re.findall(r"\{(\w*)\}", text):
        if name not in PLACEHOLDERS:
            known = ", ".join(f"{{{one}}}" for one in PLACEHOLDERS)
            raise ValueError(f"{{{name}}} stands for nothing; known: {known}")
    return text


ProgramLine = Annotated[str, Field(max_length=200), AfterValidator(_line)]
Lines = dict[SwitchedFormat, Annotated[list[ProgramLine], Field(max_length=50)]]


class Switch(Quantities):
    """What is on while the tool works: a spindle, a gun, a vacuum, a force control."""

    kinds: list[Kind] = Field(default=[])
    """Kinds of process that it is for; all unless given."""
    during: Literal["path", "line", "contact"] = "path"
    """path: from the first waypoint of a region's process to its last, as a spindle; line: on the
    surface alone, off between lines, as a spray gun; contact: where there is a contact force."""
    outputs: dict[Literal["urscript", "rapid", "krl"], str] = Field(default={})
    """Digital output that is on meanwhile, by export format: the number in urscript and krl, the
    signal's name in rapid."""
    on: Lines = Field(default={})
    """Lines of the controller's own language that switch it on, by export format. {rpm}, {force_n}
    and {feed_mm_s} stand for the process's own values."""
    off: Lines = Field(default={})
    """The same for off."""
    wait_on_s: Annotated[NotNegative, PlausibleRange(0, 60)] = 0.0
    """Wait after it was switched on: until a spindle turns, a gun sprays."""
    wait_off_s: Annotated[NotNegative, PlausibleRange(0, 60)] = 0.0
    """Wait after it was switched off."""

    @model_validator(mode="after")
    def _makes_sense(self) -> Switch:
        for name, signal in self.outputs.items():
            pattern, words = _SIGNALS[name]
            if not re.fullmatch(pattern, signal):
                raise ValueError(f"outputs: {name} takes {words}, not '{signal}'")
        if set(self.on) != set(self.off):
            unpaired = ", ".join(sorted(set(self.on) ^ set(self.off)))
            raise ValueError(f"on and off must be for the same formats; only one has {unpaired}")
        if not (self.on or self.outputs):
            raise ValueError("a switch needs outputs, or lines for on and off")
        return self

    def switches(self, format_name: str) -> bool:
        """Whether programs of a format can switch it."""
        return format_name in self.on or format_name in self.outputs


class CellTool(Quantities):
    """A tool of the cell, named as in the knowledge file."""

    name: Name
    """Its name, as the knowledge file's processes call it."""
    controller_name: Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,31}$")] | None = None
    """What the controller calls it (tooldata in rapid); made from the name unless given."""
    number: Annotated[int, Field(ge=1, le=999)] | None = None
    """Its number in the controller (krl: TOOL_DATA, apt, gcode); in the order of this file unless
    given."""
    tcp_m: Annotated[Vector, PlausibleRange(-2.0, 2.0)]
    """Tool centre point in the robot's flange frame."""
    tcp_quaternion_xyzw: Quaternion | None = None
    """Rotation from the tool frame (z into the part) to the flange frame; none unless given."""
    mass_kg: Annotated[NotNegative, PlausibleRange(0, 500)] | None = None
    """Its mass, which programs tell the controller where the language can (urscript)."""
    centre_of_mass_m: Annotated[Vector | None, PlausibleRange(-2.0, 2.0)] = None
    """Its centre of mass in the flange frame; the flange's middle unless given."""
    switches: Annotated[list[Switch], Field(max_length=20)] = Field(default=[])
    """What is switched while it works."""
