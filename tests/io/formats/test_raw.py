"""What every reader gives: points, colours and intensity of named columns."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.io.formats.raw import colours_of, intensity_of, stack

COLOURS = np.array([[255, 0, 10], [1, 2, 3]], np.uint8)
NAMES = ("red", "green", "blue")


def test_columns_are_stacked_or_missing():
    columns = {"x": np.array([1, 2]), "y": np.array([3, 4]), "z": np.array([5, 6])}
    np.testing.assert_array_equal(stack(columns, "xyz"), [[1, 3, 5], [2, 4, 6]])
    assert stack(columns, ("x", "y", "w")) is None


@pytest.mark.parametrize("scale", [1, 1.0, 1 / 255])
def test_colours_are_bytes_or_floats_up_to_one(scale):
    columns = dict(zip(NAMES, (COLOURS * scale).T, strict=True))
    np.testing.assert_allclose(colours_of(columns).astype(int), COLOURS, atol=1)


@pytest.mark.parametrize("name", ["rgb", "rgba"])
def test_packed_colours_are_bits_of_a_number_or_of_a_float(name):
    bits = COLOURS.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    for packed in (bits.astype(np.uint32), bits.astype(np.uint32).view(np.float32)):
        np.testing.assert_array_equal(colours_of({name: packed}), COLOURS)


def test_intensity_has_several_names_and_may_be_missing():
    assert intensity_of({"x": np.ones(2)}) is None
    for name in ("intensity", "scalar_Intensity", "reflectance"):
        found = intensity_of({name: np.array([3, 4], np.uint16)})
        assert found.dtype == np.float32 and found.tolist() == [3.0, 4.0]
    assert colours_of({"x": np.ones(2)}) is None
