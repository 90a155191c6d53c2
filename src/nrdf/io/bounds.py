"""Bounds of numbers: one check for options, limits and settings. NaN never passes."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from nrdf.errors import ConfigError


@dataclass(frozen=True)
class Bounds:
    """From `least` to `most`; `above`: not `least` itself. Always finite.

    Stands in annotations, `Annotated[float, Within(0.0, 1.0)]`, where `check_numbers` finds it.
    """

    least: float = -math.inf
    most: float = math.inf
    above: bool = False

    def check(self, name: str, value: float) -> None:
        """Raise ConfigError, with name and value, unless a number is within."""
        finite = isinstance(value, int) or math.isfinite(value)
        good = self.least < value if self.above else self.least <= value
        if not (finite and good and value <= self.most):
            shown = value if isinstance(value, int) else f"{value:g}"
            raise ConfigError(f"{name} {shown} must be {self.words}")

    @property
    def words(self) -> str:
        if self.most < math.inf:
            from_ = "above" if self.above else "from"
            return f"{from_} {self.least:g} to {self.most:g}"
        if self.least > -math.inf:
            return f"above {self.least:g}" if self.above else f"{self.least:g} or more"
        return "a finite number"


FINITE = Bounds()
FRACTION = Bounds(0.0, 1.0)
NON_NEGATIVE = Bounds(0.0)

Fraction = Annotated[float, FRACTION]
NonNegative = Annotated[float, NON_NEGATIVE]
Positive = Annotated[float, Bounds(0.0, above=True)]
Count = Annotated[int, Bounds(1)]
NonNegativeCount = Annotated[int, NON_NEGATIVE]
Seed = Annotated[int, NON_NEGATIVE]


def check_numbers(values: Mapping[str, Any], hints: Mapping[str, Any]) -> None:
    """Check every number among `values`, those in tuples too, by its `Bounds` in the annotations.

    Without one, whole numbers must be 0 or more, others finite. Raises ConfigError, with name and
    value, for the first that is not.
    """
    for name, value in values.items():
        bounds = next(_bounds_in(hints.get(name)), None)
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, (int, float)) and not isinstance(number, bool):
                usual = NON_NEGATIVE if isinstance(number, int) else FINITE
                (bounds or usual).check(name, number)


def _bounds_in(hint: Any) -> Iterator[Bounds]:
    yield from (m for m in getattr(hint, "__metadata__", ()) if isinstance(m, Bounds))
    for inner in typing.get_args(hint):
        yield from _bounds_in(inner)
