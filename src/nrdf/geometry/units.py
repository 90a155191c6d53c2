"""Units: of clouds, and of the quantities in files, whose names end with their unit.

Inside everything is SI. People read and write millimetres, degrees and revolutions per minute: a
file may give ``stepover_mm`` for ``stepover_m``, and `readable` shows a value as people read it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres of each unit that a cloud may have."""

_SPELLINGS = {
    "m": ("metre", "metres", "meter", "meters"),
    "cm": ("centimetre", "centimetres", "centimeter", "centimeters"),
    "mm": ("millimetre", "millimetres", "millimeter", "millimeters"),
    "in": ("inch", "inches", '"'),
}

USUAL_SIZES = {"chair": (0.4, 1.6), "car": (2.5, 8.0), "plane": (4.0, 85.0), "table": (0.4, 4.0)}
"""Longest sides (m) that objects of a category usually have."""

_FAR = 3.0  # times outside of the usual sizes from which a unit that was given counts as doubtful

OTHER_UNITS = {
    "_deg_mm": ("_rad_m", 1e3 * math.pi / 180),
    "_mm3_s": ("_m3_s", 1e-9),
    "_mm_s": ("_m_s", 1e-3),
    "_mm": ("_m", 1e-3),
    "_deg": ("_rad", math.pi / 180),
    "_rpm": ("_rad_s", 2 * math.pi / 60),
}
"""Ending of a name that a file may use, the SI name's ending, and the factor to it."""

_SHOWN = (
    ("_rad_m", 180e-3 / math.pi, "° a mm"),
    ("_rad_s", 60 / (2 * math.pi), " rpm"),
    ("_m3_s", 1e9, " mm³/s"),
    ("_m_s", 1e3, " mm/s"),
    ("_rad", 180 / math.pi, "°"),
    ("_m", 1e3, " mm"),
    ("_s", 1.0, " s"),
    ("_n", 1.0, " N"),
)


def parse_unit(word: str) -> str | None:
    """The unit of `METRES` that a file means by "mm", "Millimeters" or the like, or None."""
    word = word.strip().lower()
    return next((unit for unit in METRES if word == unit or word in _SPELLINGS[unit]), None)


def guess_unit(longest_side: float, category: str) -> str | None:
    """The only unit in which an object this long has its category's usual size, or None."""
    low, high = USUAL_SIZES.get(category, (math.inf, -math.inf))
    fitting = [unit for unit, metres in METRES.items() if low <= longest_side * metres <= high]
    return fitting[0] if len(fitting) == 1 else None


@dataclass(frozen=True)
class Unit:
    """The unit of a scan. name: one of `METRES`, None if unknown. origin: "given", "guessed" or
    "unknown". warning: why it may be wrong, "" if nothing speaks against it."""

    name: str | None
    origin: str
    warning: str = ""


def find_unit(given: str | None, longest_side: float, category: str) -> Unit:
    """The unit of a scan whose object has this longest side, in that unit.

    given: what the file or the user says, None if neither does. Models and toys exist, so a unit
    that was given is kept, whatever the size.
    """
    usual = USUAL_SIZES.get(category)
    if usual is None:
        return Unit(given, "given" if given else "unknown")
    low, high = usual
    fitting = [name for name, metres in METRES.items() if low <= longest_side * metres <= high]
    range_ = f"{low:g} to {high:g} m"
    if given is None:
        if fitting:
            several = f"a usual {category} may be this long in {' or '.join(fitting)}"
            return Unit(fitting[0], "guessed", several if len(fitting) > 1 else "")
        return Unit(None, "unknown", f"in no unit is it {range_} long, as a {category} usually is")
    size = longest_side * METRES[given]
    if low / _FAR <= size <= high * _FAR:
        return Unit(given, "given")
    hint = f"; in {fitting[0]} it would be" if fitting else ""
    return Unit(given, "given", f"{size:.3g} m is not the {range_} of a usual {category}{hint}")


def accepted_names(si_name: str) -> dict[str, float]:
    """Other names that a file may use for an SI field, each with its factor to SI."""
    for other, (si, factor) in OTHER_UNITS.items():
        if si_name.endswith(si):
            return {si_name.removesuffix(si) + other: factor}
    return {}


def to_si(content: Mapping[str, Any], si_names: list[str]) -> dict[str, Any]:
    """`content` with every other name of one of `si_names` replaced by it, its value converted.

    Values may be numbers or nested lists of them; what is neither stays as it is. Raises
    ValueError where a quantity is given twice.
    """
    converted = dict(content)
    for si_name in si_names:
        for other, factor in accepted_names(si_name).items():
            if other not in converted:
                continue
            if si_name in converted:
                raise ValueError(f"give {si_name} or {other}, not both")
            converted[si_name] = _times(converted.pop(other), factor)
    return converted


def readable(name: str, value: float) -> str:
    """A quantity as people read it: ``in_words("stepover_m", 0.015)`` is "15 mm"."""
    for ending, factor, unit in _SHOWN:
        if name.endswith(ending):
            return f"{_four_digits(value * factor)}{unit}"
    return _four_digits(value)


def _four_digits(value: float) -> str:
    """Rounded to four digits; large ones without an exponent, which few read as a length."""
    return f"{float(f'{value:.4g}'):.10g}"


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, list):
        return [_times(item, factor) for item in value]
    try:
        # Digits of the decimal number that was meant, not of the factor's rounding.
        return value if isinstance(value, bool) else float(f"{float(value) * factor:.15g}")
    except (TypeError, ValueError, OverflowError):
        return value
