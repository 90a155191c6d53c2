"""Ranges that chairs are drawn from."""

from __future__ import annotations

from dataclasses import fields

import pytest

from nrdf.shapes.families.chair_styles import STYLES


@pytest.mark.parametrize("kind", STYLES)
def test_ranges_rise_and_weights_are_positive(kind: str) -> None:
    style = STYLES[kind]
    for field in fields(style):
        value = getattr(style, field.name)
        if isinstance(value, tuple):
            assert value[0] <= value[1], field.name
        if isinstance(value, dict):
            assert value and min(value.values()) > 0, field.name
    assert 0 <= style.pierced <= 1


def test_kinds_are_all_there_is() -> None:
    assert sum(style.weight for style in STYLES.values()) == pytest.approx(1.0)
