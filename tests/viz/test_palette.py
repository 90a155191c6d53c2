"""Colours of regions, and of the scales from unsure to sure and from unlike to alike."""

from __future__ import annotations

import numpy as np

from nrdf.viz.palette import (
    REGION_COLOURS,
    confidence_scale,
    next_region_colour,
    region_colours,
    rgb,
    similarity_scale,
)


def test_every_region_has_its_own_colour():
    colours = region_colours([str(i) for i in range(12)])
    assert len({tuple(colour) for colour in colours.values()}) == 12


def test_a_thirteenth_region_has_the_first_ones_colour():
    colours = region_colours([str(i) for i in range(13)])
    np.testing.assert_array_equal(colours["12"], colours["0"])
    np.testing.assert_allclose(colours["0"], np.array([0xE6, 0x9F, 0x00]) / 255)


def test_the_next_colour_is_the_first_that_is_free():
    every = [rgb(colour) for colour in REGION_COLOURS]
    assert next_region_colour([]) == every[0] == (0xE6, 0x9F, 0x00)
    assert next_region_colour([every[0], every[2]]) == every[1]
    assert next_region_colour(every) == every[0]


def test_confidence_goes_from_red_over_yellow_to_green():
    red, yellow, green, beyond = confidence_scale(np.array([0.0, 0.5, 1.0, 3.0])).astype(int)
    assert red[0] > 2 * red[1]
    assert yellow[0] > 200 < yellow[1]
    assert green[1] > 2 * green[0]
    np.testing.assert_array_equal(beyond, green)


def test_similarity_goes_from_blue_to_yellow():
    blue, yellow = similarity_scale(np.array([0.0, 1.0])).astype(int)
    assert blue[2] > 2 * blue[0]
    assert yellow[0] > 200 < yellow[1] and yellow[2] < 50
