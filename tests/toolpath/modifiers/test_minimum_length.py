"""Short paths that nothing is lost with."""

from __future__ import annotations

import numpy as np

from builders.surface_paths import UP, rows, straight
from nrdf.toolpath.modifiers.minimum_length import minimum_length

X, Y = np.meshgrid(np.linspace(0, 0.2, 41), np.linspace(0, 0.06, 13))
POINTS = np.column_stack([X.ravel(), Y.ravel(), 0 * X.ravel()])
NORMALS = np.tile(UP, (len(POINTS), 1))


def kept(paths, **changes):
    return minimum_length(paths, 0.025, POINTS, NORMALS, 0.025, **changes)


def test_a_short_path_over_what_others_reach_goes():
    long = rows([0.015, 0.045])
    assert kept([long[0], straight((0.1, 0.03, 0), (0.11, 0.03, 0)), long[1]]) == long
    assert kept(long) == long


def test_a_short_path_that_reaches_something_stays():
    long = rows([0.015])
    short = straight((0.1, 0.05, 0), (0.11, 0.05, 0))
    assert kept([*long, short]) == [*long, short]
    assert kept([*long, short], needed=0.5) == long
    other_side = straight((0.1, 0.05, 0), (0.11, 0.05, 0), normal=-UP)
    assert kept([*long, other_side]) == long


def test_of_two_that_reach_the_same_one_stays():
    pair = [straight((0.1, y, 0), (0.11, y, 0)) for y in (0.05, 0.05)]
    assert len(kept(pair)) == 1
    assert len(kept(pair, needed=1.0)) == 1
    assert kept(pair, droppable=np.array([False, False])) == pair
    assert kept(pair, droppable=np.array([True, False])) == pair[1:]


def test_short_paths_together_lose_no_more_than_allowed():
    long = rows([0.015])
    short = [straight((x, 0.05, 0), (x + 0.01, 0.05, 0)) for x in (0.02, 0.08, 0.14)]
    assert kept([*long, *short], needed=0.5) == long
    some = kept([*long, *short], needed=0.5, lost=0.2)
    assert long[0] in some and 2 <= len(some) < 4
    assert kept([*long, *short], needed=0.5, lost=0.0) == [*long, *short]
