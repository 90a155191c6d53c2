"""Occupancy queries, and their answers as bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nrdf.errors import DataError
from nrdf.shapes.occupancy import (
    PADDING,
    occupancy_queries,
    pack_occupancies,
    unpack_occupancies,
)


def test_bits_come_back():
    occupancies = np.random.default_rng(0).random(21) < 0.5
    packed = pack_occupancies(occupancies)
    assert packed.shape == (3,)
    np.testing.assert_array_equal(unpack_occupancies(Path("a"), packed, 21), occupancies)
    loose = occupancies.astype(np.float32)
    np.testing.assert_array_equal(unpack_occupancies(Path("a"), loose, 21), occupancies)


def test_bits_of_another_number_of_queries_are_refused():
    with pytest.raises(
        DataError, match=r"a\.npz: \(3,\) occupancies of uint8 do not fit 40 queries"
    ):
        unpack_occupancies(Path("a.npz"), np.zeros(3, np.uint8), 40)


def test_odd_numbers_of_queries_are_kept_and_stay_near_the_cube():
    surface = np.zeros((5, 3))
    queries = occupancy_queries(surface, 101, np.random.default_rng(0))
    assert queries.shape == (101, 3) and queries.dtype == np.float16
    assert np.abs(queries[:50]).max() <= (1 + PADDING) / 2 + 1e-3
    assert np.abs(queries[50:]).max() < 0.3


def test_queries_are_half_uniform_and_half_near():
    surface = np.random.default_rng(0).normal(size=(300, 3))
    surface *= 0.3 / np.linalg.norm(surface, axis=1, keepdims=True)
    queries = occupancy_queries(surface, 2001, np.random.default_rng(1)).astype(float)
    assert queries.shape == (2001, 3)
    uniform, near = queries[:1000], queries[1000:]
    assert np.abs(uniform).max() <= 0.5505 and np.abs(uniform).max(axis=0).min() > 0.54
    distance = np.abs(np.linalg.norm(near, axis=1) - 0.3)
    assert distance.mean() < 0.03 and np.median(distance) < 0.015 and distance.max() > 0.06
