from __future__ import annotations

import math

import pytest
from pydantic import Field, ValidationError

from nrdf.io.schema import StrictModel, validation_messages


class Wheel(StrictModel):
    radius: float = Field(gt=0)
    material: str = "rubber"


class Car(StrictModel):
    name: str
    wheels: list[Wheel] = Field(default=[])
    spare: Wheel | None = None


def complaints(content, **options):
    with pytest.raises(ValidationError) as caught:
        Car.model_validate(content)
    return validation_messages(caught.value, Car, **options)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"nmae": "a", "name": "b"}, "unknown key 'nmae'; did you mean 'name'? (known: name, "),
        ({"name": "a", "wheels": [{"radius": 0}]}, "wheels.0.radius: must be above 0.0, not 0"),
        ({"name": "a", "wheels": [{"radus": 1, "radius": 1}]}, "did you mean 'radius'?"),
        ({"name": "a", "spare": {"radius": 1, "matrial": "x"}}, "did you mean 'material'?"),
        ({"name": "a", "wheels": [{"radius": "wide"}]}, "must be a number, not 'wide'"),
        ({"name": "a", "wheels": [{"radius": math.inf}]}, "must be a finite number, not inf"),
        ({}, "name: is missing"),
        ({"name": ["long"] * 99}, "name: must be text"),
        ({"name": "a", "wheels": [{"radius": 1, "material": 9}]}, "must be text, not 9"),
        ({"name": "a", "wheels": 3}, "wheels: must be a list, not 3"),
    ],
)
def test_place_fault_and_value_are_named(content, message):
    assert any(message in line for line in complaints(content))


def test_every_fault_gets_a_line_and_long_values_are_cut():
    lines = complaints({"wheels": [{"radius": "x" * 300}]})
    assert len(lines) == 2 and all(len(line) < 120 for line in lines)


def test_the_place_may_be_put_into_words():
    lines = complaints(
        {"name": "a", "wheels": [{}]}, place=lambda location: f"{len(location)} deep"
    )
    assert lines == ["3 deep: is missing"]
