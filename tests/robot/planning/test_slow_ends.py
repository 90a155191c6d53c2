"""Where an arm is slower than its feed, as much is left as at its feed."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.robot.planning.slow_ends import gun_waits


def a_move(up, even, down):
    """Shares of the feed at each step of a move from rest to rest."""
    return np.concatenate([np.linspace(0, 1, up), np.ones(even), np.linspace(1, 0, down)])


@pytest.mark.parametrize("steps", [(40, 100, 40), (30, 80, 60), (20, 0, 20), (4, 1, 4)])
def test_a_gun_is_on_as_long_as_its_way_takes_at_its_feed(steps):
    share = a_move(*steps)
    off = gun_waits(share, np.ones(len(share), bool))
    assert (~off).sum() == pytest.approx(share.sum(), abs=2.0)
    assert off[0] and off[-1] and not off[len(off) // 2]


def test_a_gun_that_goes_on_at_its_feed_waits_for_nothing():
    share = a_move(40, 100, 40)
    on = np.ones(len(share), bool)
    on[:40] = on[-40:] = False  # in its run-ups
    assert not gun_waits(share, on).any()


def test_where_joints_are_slow_inside_a_line_its_gun_stays_on():
    share = a_move(10, 200, 10)
    share[90:120] = 0.5
    off = gun_waits(share, np.ones(len(share), bool))
    assert not off[20:-20].any()
