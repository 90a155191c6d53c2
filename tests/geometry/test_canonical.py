"""Canonical coordinates: a unit box around the origin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nrdf.errors import CloudError
from nrdf.geometry.canonical import MIRROR, bounding_box, canonical_transform, rotation_about_up


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


def test_turns_about_up_are_from_z_towards_x():
    np.testing.assert_allclose(rotation_about_up(np.pi / 2) @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    several = rotation_about_up(np.array([[0.1, 0.2], [0.3, 0.4]]))
    assert several.shape == (2, 2, 3, 3)
    np.testing.assert_allclose(several[1, 0], rotation_about_up(0.3))


def test_the_mirror_image_swaps_left_and_right_and_turns():
    mirrored = rotation_about_up(0.3) @ np.diag(MIRROR)
    np.testing.assert_allclose(mirrored, np.diag(MIRROR) @ rotation_about_up(-0.3), atol=1e-12)
