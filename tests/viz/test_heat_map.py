"""Heat maps."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.process_model.cells import plate
from nrdf.viz.heat_map import COLOURS, LEVELS, heat_map, levels_of


def test_ranges_are_in_tolerances_off_the_target():
    values = np.array([0.0, 55.5, 60.0, 65.5, 71.0, 200.0]) * 1e-6
    assert levels_of(values, 60e-6, 10e-6).tolist() == [0, 4, 4, 5, 6, 8]
    assert len(COLOURS) == len(LEVELS) - 1


def test_too_little_is_blue_and_too_much_is_red():
    mesh = plate(1.0, 0.5, 0.05)
    values = np.where(mesh.vertices[mesh.faces].mean(axis=1)[:, 0] < 0.0, 0.0, 200e-6)
    drawn = heat_map(mesh, mesh, values, 60e-6, 10e-6, size=200)
    assert drawn.shares[0] == pytest.approx(0.5) and drawn.shares[-1] == pytest.approx(0.5)
    red, _, blue = np.moveaxis(drawn.image, -1, 0)
    assert (red - blue > 0.2).mean() > 0.1 and (blue - red > 0.2).mean() > 0.1
