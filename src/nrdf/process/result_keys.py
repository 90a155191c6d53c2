"""Keys of a process for its result: what is wanted, and limits on the feeds that it takes."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from nrdf.process.quantities import PlausibleRange, Positive, Quantities
from nrdf.toolpath.types import ACCELERATION_M_S2

_NUMBER = r"\d+(?:\.\d+)?(?:[eE][+-]?\d+)?"
_TEXT = re.compile(rf"\s*({_NUMBER})\s*(?:±|\+/-|\+-)\s*({_NUMBER})\s*(?:µm|μm|um)?\s*")
_HOW = "write it as 60 ± 10, or as value: 60 and tolerance: 10"


class Amount(Quantities):
    """How much film or depth is wanted, in µm: "60 ± 10", or value and tolerance."""

    value: Annotated[Positive, PlausibleRange(0.01, 10_000.0)]
    """What is wanted, µm."""
    tolerance: Positive
    """How far off it may be, µm."""
    most: Positive | None = None
    """What may be there at most, µm, such as the layer that is sanded; more is warned of."""

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, content: Any) -> Any:
        if not isinstance(content, (str, int, float)) or isinstance(content, bool):
            return content
        found = _TEXT.fullmatch(str(content))
        if found is None:
            raise ValueError(f"{content!r} is no amount with a tolerance; {_HOW}")
        return {"value": float(found[1]), "tolerance": float(found[2])}

    @model_validator(mode="after")
    def _makes_sense(self) -> Amount:
        if self.tolerance >= self.value:
            raise ValueError(
                f"a tolerance of {self.tolerance:g} on {self.value:g}; it must be below the value"
            )
        if self.most is not None and self.most < self.value:
            raise ValueError(f"most is {self.most:g}, less than the value, {self.value:g}")
        return self

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        mapping = handler.resolve_ref_schema(handler(core_schema))
        text = {"type": "string", "pattern": f"^{_TEXT.pattern}$"}
        return {"anyOf": [mapping, text], "description": mapping.get("description", "")}


class FeedLimitKeys(Quantities):
    """What tool and robot can do where feeds are chosen by the result."""

    least_m_s: Annotated[Positive, PlausibleRange(1e-4, 5.0)] = 0.01
    """Least speed along lines."""
    most_m_s: Annotated[Positive, PlausibleRange(1e-4, 5.0)] = 1.0
    """Largest speed along lines."""
    acceleration_m_s2: Annotated[Positive, PlausibleRange(0.01, 50.0)] = ACCELERATION_M_S2
    """Largest acceleration, along the lines and at their bends."""

    @model_validator(mode="after")
    def _makes_sense(self) -> FeedLimitKeys:
        if self.least_m_s > self.most_m_s:
            raise ValueError(
                f"least_m_s is {self.least_m_s:g}, more than most_m_s, {self.most_m_s:g}"
            )
        return self
