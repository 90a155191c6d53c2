"""Quantities in files: SI fields whose names end with their unit, and what may stand for them."""

from __future__ import annotations

import copy
import math
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from nrdf.strict import Strict
from nrdf.units import other_names, to_si

_BOUNDS = ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum")


def _name(text: str) -> str:
    # Names end up in robot programs, where a line break would begin a new statement.
    if not text.isprintable() or text != text.strip() or not text:
        raise ValueError("a name needs printable characters and no spaces at its ends")
    return text


def _direction(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if math.hypot(*vector) < 1e-9:
        raise ValueError("a direction needs a length above 0")
    return vector


def _quaternion(q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    length = math.hypot(*q)
    if abs(length - 1) > 1e-3:
        raise ValueError(f"a quaternion needs length 1, not {length:.4g}")
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


Name = Annotated[str, Field(max_length=200), AfterValidator(_name)]
# Strict, because YAML's yes and no would count as 1 and 0.
Number = Annotated[float, Field(strict=True)]
Positive = Annotated[Number, Field(gt=0)]
NotNegative = Annotated[Number, Field(ge=0)]
Angle = Annotated[Number, Field(gt=-math.pi / 2, lt=math.pi / 2)]
Vector = tuple[Number, Number, Number]
Direction = Annotated[Vector, AfterValidator(_direction)]
Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_quaternion)]


class Quantities(Strict):
    """A strict model whose SI fields may be given in the units that people use."""

    model_config = ConfigDict(use_attribute_docstrings=True)

    @classmethod
    def known_keys(cls) -> list[str]:
        fields = list(cls.model_fields)
        return fields + [other for name in fields for other in other_names(name)]

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
            for other, factor in other_names(name).items():
                properties[other] = _scaled(properties[name], 1 / factor)
                properties[other]["description"] = f"Instead of {name}."
                if name in schema.get("required", ()):
                    schema["required"].remove(name)
                    either = [{"required": [name]}, {"required": [other]}]
                    schema.setdefault("allOf", []).append({"oneOf": either})
        return schema


def _scaled(schema: dict[str, Any], factor: float) -> dict[str, Any]:
    """The JSON schema of a number with its bounds in another unit, without title and default."""
    scaled = {key: copy.deepcopy(schema[key]) for key in schema if key not in ("title", "default")}
    scaled |= {key: scaled[key] * factor for key in _BOUNDS if key in scaled}
    if "anyOf" in scaled:
        scaled["anyOf"] = [_scaled(option, factor) for option in scaled["anyOf"]]
    return scaled
