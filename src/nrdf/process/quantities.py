"""Quantities in files: SI fields named with their unit, also read in mm, degrees and rpm."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from nrdf.geometry.units import accepted_names, readable, to_si
from nrdf.io.schema import StrictModel

_BOUNDS = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")


def _name(text: str) -> str:
    # Names end up in robot programs, where a line break would begin a new statement.
    if not text.isprintable() or text != text.strip() or not text:
        raise ValueError("a name needs printable characters and no spaces at its ends")
    return text


def _file_name(text: str) -> str:
    if not text or "\0" in text or not _is_writable(text):
        raise ValueError("a file's name needs characters that a file system takes")
    return text


def _is_writable(text: str) -> bool:
    """Whether a text has no half of a surrogate pair, which no file can hold."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


def _plain(content: Any) -> Any:
    """Content that every kind of file can hold."""
    if isinstance(content, dict):
        for key, value in content.items():
            _plain(key)
            _plain(value)
    elif isinstance(content, (list, tuple)):
        for value in content:
            _plain(value)
    elif isinstance(content, str):
        if not _is_writable(content):
            raise ValueError("text with half of a surrogate pair in it")
    elif isinstance(content, float):
        if not math.isfinite(content):
            raise ValueError(f"numbers must be finite, not {content}")
    elif not isinstance(content, (int, type(None))):
        kind = type(content).__name__
        raise ValueError(f"text, numbers, true, false, null, lists and mappings only, not {kind}")
    return content


def _direction(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if math.hypot(*vector) < 1e-9:
        raise ValueError("a direction needs a length above 0")
    return vector


def _quaternion(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = math.hypot(*q)
    if abs(length - 1) > 1e-3:
        raise ValueError(f"a quaternion needs length 1, not {length:.4g}")
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


@dataclass(frozen=True)
class PlausibleRange:
    """The plausible range of a quantity; a file must say that a value outside is meant."""

    least: float
    most: float

    def fault(self, name: str, value: float) -> str:
        """Why a value is not plausible, with its unit; "" where it is."""
        if self.least <= value <= self.most:
            return ""
        side, limit = ("below", self.least) if value < self.least else ("above", self.most)
        return (
            f"{name} is {value:g} ({readable(name, value)}), {side} what is plausible, "
            f"{limit:g} ({readable(name, limit)})"
        )


Name = Annotated[str, Field(max_length=200), AfterValidator(_name)]
# Strict, because YAML's yes and no would count as 1 and 0.
Number = Annotated[float, Field(strict=True, ge=-1e9, le=1e9)]
Coordinate = Annotated[Number, Field(ge=-1e6, le=1e6)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Angle = Annotated[Number, Field(gt=-math.pi / 2, lt=math.pi / 2)]
Vector = tuple[Coordinate, Coordinate, Coordinate]
Direction = Annotated[Vector, AfterValidator(_direction)]
Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_quaternion)]
FileName = Annotated[str, Field(max_length=4096), AfterValidator(_file_name)]
PlainMapping = Annotated[dict[str, Any], AfterValidator(_plain)]
"""Free content: anything that YAML and JSON can hold."""


class Quantities(StrictModel):
    """A strict model whose SI fields may be given in the units that people use."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    @classmethod
    def known_keys(cls) -> list[str]:
        fields = list(cls.model_fields)
        return fields + [other for name in fields for other in accepted_names(name)]

    @model_validator(mode="before")
    @classmethod
    def _to_si(cls, content: Any) -> Any:
        return to_si(content, list(cls.model_fields)) if isinstance(content, dict) else content

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        schema = handler.resolve_ref_schema(handler(core_schema))
        properties = schema.get("properties", {})
        for name in list(properties):
            for plausible in _plausible_ranges(cls, name):
                hint = f"Plausible: {plausible.least:.6g} to {plausible.most:.6g}."
                description = properties[name].get("description", "")
                properties[name]["description"] = f"{description} {hint}".strip()
            for other, factor in accepted_names(name).items():
                properties[other] = _scaled(properties[name], 1 / factor)
                properties[other]["description"] = f"Instead of {name}."
                if name in schema.get("required", ()):
                    schema["required"].remove(name)
                    either = [{"required": [name]}, {"required": [other]}]
                    schema.setdefault("allOf", []).append({"oneOf": either})
        return schema


def implausible(model: Quantities, within: str = "") -> list[str]:
    """A line for each quantity of a model, and of those in it, outside its plausible range.

    within: the model's own name and a dot, where it is in another.
    """
    lines = []
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, Quantities):
            lines += implausible(value, f"{within}{name}.")
        elif value is not None:
            numbers = value if isinstance(value, tuple) else (value,)
            faults = (
                u.fault(within + name, n)
                for u in _plausible_ranges(type(model), name)
                for n in numbers
            )
            lines += [fault for fault in faults if fault][:1]
    return lines


def _plausible_ranges(model: type[Quantities], name: str) -> list[PlausibleRange]:
    field = model.model_fields.get(name)
    return (
        []
        if field is None
        else [item for item in field.metadata if isinstance(item, PlausibleRange)]
    )


def _scaled(schema: dict[str, Any], factor: float) -> dict[str, Any]:
    """The JSON schema of a number with its bounds in another unit, without title and default."""
    scaled = {key: copy.deepcopy(schema[key]) for key in schema if key not in ("title", "default")}
    scaled |= {key: scaled[key] * factor for key in _BOUNDS if key in scaled}
    if "anyOf" in scaled:
        scaled["anyOf"] = [_scaled(option, factor) for option in scaled["anyOf"]]
    return scaled
