"""The types of the verbs' options, and what `--help` calls their values."""

from __future__ import annotations

import types
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal


@dataclass(frozen=True)
class Metavar:
    """In an annotation: what `--help` calls a value, `Annotated[Path, Metavar("FILE")]`."""

    text: str


File = Annotated[Path, Metavar("FILE")]
Folder = Annotated[Path, Metavar("FOLDER")]
Cluster = Annotated[str, Metavar("ADDRESS")]
Sensors = Annotated[tuple[float, ...], Metavar("X Y Z ...")]
Up = Annotated[str, Metavar("AXIS")]
Unit = Literal["m", "cm", "mm", "in"]
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
Skip = Literal["thin", "duplicates", "floor", "outliers", "objects"]
"""Steps of cleaning a scan that can be left out."""

UNITS = {"mm": "MM", "m": "M", "deg": "DEG", "s": "SECONDS"}
"""The last word of an option's name, and the unit that `--help` shows for it."""
_TYPES = {int: "N", float: "NUMBER", Path: "PATH"}


def metavar_of(name: str, hint: Any) -> str:
    """What `--help` calls the value of the parameter `name` with the annotation `hint`.

    A `Metavar` in the annotation comes first, then the choices of a Literal, then the unit that the
    name ends in. A text is called by the parameter's name. Several values end in " ...".
    """
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin is Annotated:
        given = [mark.text for mark in inner[1:] if isinstance(mark, Metavar)]
        return given[0] if given else metavar_of(name, inner[0])
    if origin in (typing.Union, types.UnionType):
        return "|".join(metavar_of(name, one) for one in inner if one is not type(None))
    if origin is tuple:
        if Ellipsis in inner:
            return f"{metavar_of(name, inner[0])} ..."
        return " ".join(metavar_of(name, one) for one in inner)
    if origin is Literal:
        return "{" + ",".join(map(str, inner)) + "}"
    last = name.rpartition("_")[2]
    if hint in (int, float) and last in UNITS:
        return UNITS[last]
    return _TYPES.get(hint, last.upper())
