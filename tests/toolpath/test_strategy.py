from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.toolpath.strategy import TRAJECTORIES, Strategy


def test_every_trajectory_is_taken():
    for name in TRAJECTORIES:
        assert Strategy(name).trajectory == name
    with pytest.raises(ProcessError, match=r"trajectory 'zigzag'.*raster"):
        Strategy("zigzag")


@pytest.mark.parametrize(
    "field, value",
    [("stepover_m", 0.0), ("feed_m_s", np.nan), ("passes", 0), ("edge_margin_m", -0.1)],
)
def test_a_value_that_cannot_be_is_named(field, value):
    with pytest.raises(ProcessError, match=f"{field} is {value}; give"):
        Strategy(**{field: value})


def test_a_direction_is_three_numbers_that_are_not_all_zero():
    assert Strategy(direction=(0.0, 0.0, 2.0)).direction == (0.0, 0.0, 2.0)
    for wrong in ((0.0, 0.0, 0.0), (1.0, 0.0), (np.inf, 0.0, 0.0)):
        with pytest.raises(ProcessError, match=r"direction is .*give 3 numbers"):
            Strategy(direction=wrong)
