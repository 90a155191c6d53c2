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
