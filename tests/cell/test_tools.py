"""Tools of a cell: what their switches may say."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from nrdf.cell.tools import Switch


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({}, "needs outputs, or lines"),
        ({"outputs": {"urscript": "8"}}, "a standard digital output, 0 to 7"),
        ({"outputs": {"rapid": "1; Stop"}}, "the name of a digital output signal"),
        ({"outputs": {"krl": "0"}}, "the number of an output"),
        ({"on": {"krl": ["A"]}}, "only one has krl"),
        ({"on": {"krl": ["A\nB"]}, "off": {"krl": ["C"]}}, "no line break"),
        ({"on": {"krl": ["S={speed}"]}, "off": {"krl": ["C"]}}, r"known: \{rpm\}"),
    ],
)
def test_a_switch_without_sense_is_refused_in_words(content, said):
    with pytest.raises(ValidationError, match=said):
        Switch.model_validate(content)


def test_a_switch_knows_its_formats():
    switch = Switch.model_validate(
        {"outputs": {"krl": "4"}, "on": {"apt": ["X"]}, "off": {"apt": ["Y"]}}
    )
    assert [f for f in ("urscript", "krl", "apt") if switch.switches(f)] == ["krl", "apt"]
