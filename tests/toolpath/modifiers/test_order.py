"""The order of paths."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surface_paths import rows
from nrdf.toolpath.modifiers.order import order_nearest, way_between

PLACES = np.arange(6) * 0.02


def test_rows_become_a_snake():
    ordered = order_nearest(rows(PLACES))
    assert [path.contacts[0, 1] for path in ordered] == pytest.approx(PLACES)
    assert [path.contacts[0, 0] for path in ordered] == pytest.approx([0, 0.2] * 3)
    assert way_between(ordered) == pytest.approx(5 * 0.02)


def test_every_path_is_driven_once_the_nearest_next():
    mixed = rows(PLACES[[0, 3, 1, 5, 2, 4]])
    ordered = order_nearest(mixed)
    assert [path.contacts[0, 1] for path in ordered] == pytest.approx(PLACES)
    one_way = order_nearest(mixed, one_way=True)
    assert [path.contacts[0, 0] for path in one_way] == pytest.approx([0.0] * 6)
    assert {id(path) for path in one_way} == {id(path) for path in mixed}


def test_a_shorter_order_than_the_nearest_next_is_kept():
    # From 0 the nearest next is 0.01, then everything on the other side is far.
    given = rows([0.0, -0.011, -0.04, 0.010, 0.03], length=0.01)
    made = order_nearest(given)
    assert way_between(made) <= way_between(given)
    assert order_nearest(given[:2]) == given[:2]
    assert order_nearest([]) == []
