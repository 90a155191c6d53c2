"""Canonical coordinates: a unit box around the origin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nrdf.errors import CloudError
from nrdf.geometry.canonical import bounding_box, canonical_transform


@settings(max_examples=50, deadline=None)
@given(
    st.integers(2, 40),
    st.floats(1e-3, 1e3),
    st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    st.integers(0, 1000),
)
def test_canonical_points_fill_a_unit_box(count, size, shift, seed):
    points = np.random.default_rng(seed).normal(size=(count, 3)) * size + shift
    centre, scale = canonical_transform(points)
    lowest, highest = bounding_box((points - centre) / scale)
    np.testing.assert_allclose(lowest, -highest, atol=1e-9)
    assert (highest - lowest).max() == pytest.approx(1.0)


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.ones((5, 3)), np.full((3, 3), np.nan)])
def test_points_without_extent_have_no_canonical_frame(points):
    with pytest.raises(CloudError):
        canonical_transform(points)
