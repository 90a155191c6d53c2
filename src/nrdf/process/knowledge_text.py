"""Knowledge as commented YAML: the meaning of each field, and SI values in mm and degrees."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from nrdf.geometry.units import OTHER_UNITS, readable
from nrdf.io.yaml_json import to_yaml_line
from nrdf.process.knowledge import Knowledge

HEADER = """\
# Process knowledge for nrdf: what is done on which region, taught on one object.
"""
EXPLANATION = """\
# Quantities are SI; millimetres, degrees and rpm are understood as well: stepover_mm: 15 is
# stepover_m: 0.015, and so are tilt_deg, feed_mm_s and spindle_rpm. Lines that begin with # are not
# set. Directions and points are in the reference cloud's own frame.
#   nrdf check FILE         shows what it says and whether it fits the reference
#   nrdf transfer FILE new.ply
"""
_WIDTH = 100
_RARE = ("origin", "mask", "indices", "points_m", "normals")
"""Fields that are left out where they are not set, even in an explained file."""


def to_yaml(knowledge: Knowledge, explained: bool) -> str:
    """A knowledge file's text. `explained`: every field once with its meaning, also unset ones."""
    lines = _Lines(explained).of(knowledge, "")
    return HEADER + EXPLANATION * explained + "\n".join(lines) + "\n"


def model_lines(model: BaseModel, explained: bool) -> list[str]:
    """The YAML lines of a model's fields; `explained` as `to_yaml` has it."""
    return list(_Lines(explained).of(model, ""))


class _Lines:
    """Writes YAML line by line; explains the fields of each model where it first occurs."""

    def __init__(self, explained: bool) -> None:
        self.explained = explained
        self._told: set[type[BaseModel]] = set()

    def of(self, model: BaseModel, indent: str, full: bool = False) -> Iterator[str]:
        """The lines of a model's fields, `indent` in front of each; `full`: also default ones."""
        tell = self.explained and type(model) not in self._told
        full = full or tell
        self._told.add(type(model))
        for name, field in type(model).model_fields.items():
            value = getattr(model, name)
            meaning = " ".join((field.description or "").split()) if tell else ""
            is_default = not field.is_required() and value == field.default and name != "version"
            if is_default and (not full or name in _RARE):
                continue
            if value is None:
                if tell:
                    yield from _commented(f"{indent}# {name}:", meaning, indent)
            elif isinstance(value, BaseModel):
                yield from _commented(f"{indent}{name}:", meaning, indent)
                yield from self.of(value, indent + "  ", full)
            elif isinstance(value, list) and value and isinstance(value[0], BaseModel):
                yield from _commented(f"{indent}{name}:", meaning, indent)
                for item in value:
                    first, *others = self.of(item, indent + "    ")
                    # A comment above the item's first field stays above its dash.
                    while first.lstrip().startswith("#"):
                        yield first
                        first, *others = others
                    yield f"{indent}  - {first.lstrip()}"
                    yield from others
            else:
                comment = ". ".join(filter(None, (_as_people_say(name, value), meaning)))
                yield from _commented(f"{indent}{name}: {_plain(value)}", comment, indent)


def _commented(line: str, comment: str, indent: str) -> Iterator[str]:
    if not comment:
        yield line
    elif len(line) + len(comment) + 4 <= _WIDTH:
        yield f"{line}  # {comment}"
    else:
        text, words = "", comment.split()
        for word in words:
            if len(indent) + len(text) + len(word) + 3 > _WIDTH:
                yield f"{indent}#{text}"
                text = ""
            text += f" {word}"
        yield f"{indent}#{text}"
        yield line


def _as_people_say(name: str, value: Any) -> str:
    """A number's comment: "15 mm" where the file says 0.015."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not any(name.endswith(si) for si, _ in OTHER_UNITS.values()):
        return ""
    return readable(name, float(value))


def _plain(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, float):
        return repr(float(f"{value:.10g}"))
    if isinstance(value, bool):
        return "true" if value else "false"
    return to_yaml_line(value)
