from __future__ import annotations

import numpy as np

from builders.arm_cells import UP, WALL_PLACE
from nrdf.robot.model.cell import Placement
from nrdf.robot.planning.placement import _candidates, find_placement


def test_a_given_placement_is_kept_and_judged(arm, wall):
    field, rng = wall.cell.distance_field, np.random.default_rng(0)
    near, share = find_placement(arm, [wall.path], field, UP, WALL_PLACE, 1, rng)
    assert near is WALL_PLACE and share > 0.8
    far = Placement((4.0, 0.0, 0.3), np.pi, 0.1, (0.0,))
    assert find_placement(arm, [wall.path], field, UP, far, 1, rng)[1] == 0.0


def test_candidates_keep_the_base_clear_of_the_turning_object(arm, wall):
    made = _candidates(arm, wall.cell.distance_field, UP, 4)
    assert len(made) == 18 and len(set(made)) == 18
    radius = 0.5 * np.hypot(0.28, 0.2)
    for placement in made:
        assert placement.base_m[0] > radius + 0.1
        np.testing.assert_allclose(placement.turntable_rad, np.arange(4) * np.pi / 2)
