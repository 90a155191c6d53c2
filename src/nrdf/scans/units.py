"""The unit of a scan: what its file says, what the user says, or what would make its size usual."""

from __future__ import annotations

from dataclasses import dataclass

METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
"""Length of each unit in metres; guesses prefer them in this order."""
USUAL = {"chair": (0.45, 1.6), "car": (2.4, 7.0), "plane": (4.0, 80.0), "table": (0.35, 3.5)}
"""Longest sides (m) that objects of a category usually have."""
_FAR = 3.0  # times outside of the usual sizes from which a unit that was given is doubted


@dataclass(frozen=True)
class Unit:
    """name: one of `METRES`, None if unknown. origin: "given", "guessed" or "unknown". doubt: what
    speaks against it, "" if nothing does."""

    name: str | None
    origin: str
    doubt: str = ""


def find_unit(given: str | None, longest_side: float, category: str) -> Unit:
    """The unit of a scan whose object has this longest side, in that unit.

    given: what the file or the user says, None if neither does. Models and toys exist, so a unit
    that was given is kept, whatever the size.
    """
    usual = USUAL.get(category)
    if usual is None:
        return Unit(given, "given" if given else "unknown")
    low, high = usual
    fitting = [name for name, metres in METRES.items() if low <= longest_side * metres <= high]
    range_ = f"{low:g} to {high:g} m"
    if given is None:
        if fitting:
            return Unit(fitting[0], "guessed")
        doubt = f"the unit is unknown: in none is it {range_} long, as a {category} usually is"
        return Unit(None, "unknown", doubt)
    size = longest_side * METRES[given]
    if low / _FAR <= size <= high * _FAR:
        return Unit(given, "given")
    hint = f"; in {fitting[0]} it would be" if fitting else ""
    doubt = f"the unit may be wrong: {size:.3g} m is not the {range_} of a usual {category}{hint}"
    return Unit(given, "given", doubt)
