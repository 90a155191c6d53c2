"""Random cars between and around typical ones."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families.car_styles import random_style

STYLES = [random_style(np.random.default_rng(seed)) for seed in range(300)]


def test_stations_of_a_car_are_in_order() -> None:
    for style in STYLES:
        order = ("front_axle", "screen_base", "screen_top", "roof_end", "window_base", "boot_edge")
        stations = [style[name] for name in order if name != "front_axle"]
        assert (np.diff(stations) > 0).all()
        assert 0 < style["front_axle"] < style["rear_axle"] < 1


def test_lengths_are_those_of_cars_in_metres() -> None:
    for style in STYLES:
        assert 2.3 < style["length"] < 6.5
        assert style["width"] >= 0.38 * style["length"]
        assert style["bonnet_y"] < style["screen_y"] < style["height"]


def test_a_generator_fixes_the_style_and_styles_vary() -> None:
    assert random_style(np.random.default_rng(5)) == STYLES[5]
    assert len({style["length"] for style in STYLES}) == len(STYLES)
    assert {style["upright"] for style in STYLES} == {0.0, 1.0}
