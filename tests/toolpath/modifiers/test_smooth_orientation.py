"""The limit on the turn of the axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.surface_paths import over_an_edge, straight
from nrdf.geometry.frames import angles_between
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.modifiers.smooth_orientation import (
    LARGEST_TILT_RAD,
    LARGEST_TURN_RAD_M,
    smooth_orientation,
    steady_normals,
)
from nrdf.toolpath.modifiers.split import turns


def rates(path):
    return turns(path.normals) / step_lengths(path.contacts)


@pytest.mark.parametrize("degrees", [20, 45, 60, 85, 120, 180])
@pytest.mark.parametrize("spacing", [0.002, 0.01])
def test_no_turn_is_above_the_limit(degrees, spacing):
    path = over_an_edge(np.radians(degrees), spacing)
    given = path.normals.copy()
    made = smooth_orientation([path])
    assert all(rates(one).max() <= LARGEST_TURN_RAD_M for one in made)
    # A step may take 3° a mm itself, and its ends 35° each.
    assert len(made) == (1 if degrees <= 2 * 35 + 3e3 * spacing else 2)
    for one in made:
        np.testing.assert_allclose(np.linalg.norm(one.normals, axis=1), 1.0)
        before = path.normals[np.searchsorted(path.contacts[:, 0], one.contacts[:, 0] - 1e-9)]
        assert angles_between(one.normals, before).max() <= LARGEST_TILT_RAD
    assert np.array_equal(np.concatenate([one.contacts for one in made]), path.contacts)
    assert np.array_equal(path.normals, given)


def test_what_turns_slowly_stays_as_it_is():
    flat, round_ = straight((0, 0, 0), (0.2, 0, 0)), over_an_edge(0.5)
    assert smooth_orientation([flat])[0] is flat
    assert smooth_orientation([round_])[0] is round_
    assert smooth_orientation([]) == []


def test_normals_are_averaged_along_a_line_to_its_very_ends():
    path = over_an_edge(np.radians(60.0), 0.002)
    (made,) = steady_normals([path], 0.03)
    assert rates(made).max() < 0.1 * rates(path).max()
    assert steady_normals([path], 0.0)[0] is path
    bent = replace(path, normals=path.normals.copy())
    bent.normals[-1] = bent.normals[0]  # a single one at the end has no weight of its own
    (made,) = steady_normals([bent], 0.03)
    assert angles_between(made.normals[-1:], bent.normals[-2:-1])[0] < np.radians(20.0)
