"""Random aircraft around typical ones."""

from __future__ import annotations

import numpy as np

from nrdf.shapes.families.plane_styles import random_style

STYLES = [random_style(np.random.default_rng(seed)) for seed in range(300)]


def test_measures_are_possible() -> None:
    for style in STYLES:
        assert style.nose <= 0.4
        assert style.square >= 1.9
        assert 0 < style.radius < 0.3
        assert -0.03 <= style.sweep < np.radians(75)
        assert 0 < style.tail_span < style.span


def test_a_generator_fixes_the_style_and_kinds_vary() -> None:
    assert random_style(np.random.default_rng(3)) == STYLES[3]
    assert len({style.kind for style in STYLES}) > 8
    assert len({style.engines for style in STYLES}) > 3
