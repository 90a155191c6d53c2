"""Models of files that people write: unknown keys are refused, and every fault is explained."""

from __future__ import annotations

import difflib
import typing
from collections.abc import Callable, Iterable
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

Location = tuple[int | str, ...]
_LONGEST_VALUE, _LONGEST_PLACE = 60, 200
_WORDS = {
    "missing": "is missing",
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "literal_error": "must be {expected}",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_from_float": "must be a whole number",
    "string_type": "must be text",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "dict_type": "must be a mapping",
    "model_type": "must be a mapping",
}
"""Pydantic's kinds of complaint in our words; it says the others itself."""


class StrictModel(BaseModel):
    """A model that takes no unknown key and no number that is not finite, and does not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def known_keys(cls) -> list[str]:
        """The keys that a file may use."""
        return list(cls.model_fields)


def validation_messages(
    error: ValidationError,
    model: type[BaseModel],
    place: Callable[[Location], str] = lambda location: ".".join(map(str, location)),
    most: int | None = None,
) -> list[str]:
    """Each complaint as place, fault and value; for an unknown key the nearest known one.

    `model` is what was validated; `place` puts a location (keys and list positions) into words.
    most: only so many, of the first.
    """
    return [_line(dict(item), model, place) for item in error.errors(include_url=False)[:most]]


def suggest_name(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: the nearest known one, and all of them."""
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    return f"{hint} (known: {', '.join(names)})"


def _line(item: dict[str, Any], model: type[BaseModel], place: Callable[[Location], str]) -> str:
    location: Location = item["loc"]
    where = _cut(place(location), _LONGEST_PLACE)
    if item["type"] == "extra_forbidden":
        keys = _keys_at(model, location[:-1])
        return f"unknown key '{where}'{suggest_name(str(location[-1]), keys)}"
    words = _WORDS.get(item["type"], item["msg"].removeprefix("Value error, "))
    words = words.format(**item.get("ctx", {})) if item["type"] in _WORDS else words
    value = item["input"]
    plain = isinstance(value, (str, int, float, bool, type(None)))
    if item["type"] != "missing" and plain and not item["type"].startswith("json"):
        shown = _cut(repr(value), _LONGEST_VALUE)
        words += f", not {shown}" if item["type"] in _WORDS else f" (it is {shown})"
    return f"{where}: {words}" if where else words


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 4] + " ..."


def _keys_at(model: type[BaseModel], location: Location) -> list[str]:
    """The keys that are known at a place in what `model` describes."""
    kind: Any = model
    for part in location:
        if isinstance(part, str) and _is_model(kind) and part in kind.model_fields:
            kind = _inner(kind.model_fields[part].annotation)
    if not _is_model(kind):
        return []
    return kind.known_keys() if issubclass(kind, StrictModel) else list(kind.model_fields)


def _inner(annotation: Any) -> Any:
    """The model that an annotation is about: `Stage` of `list[Stage]`, `X` of `X | None`."""
    if _is_model(annotation):
        return annotation
    found = (_inner(argument) for argument in typing.get_args(annotation))
    return next((kind for kind in found if kind is not None), None)


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
