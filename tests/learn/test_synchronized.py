"""Maps within a collection, made consistent by one another."""

from __future__ import annotations

import numpy as np
import pytest

from builders.desk_lamps import lamp, sampled
from nrdf.learn import synchronized
from nrdf.learn.synchronized import synchronized_groups
from nrdf.regions.model import load_model
from nrdf.training.general_pairs import MEMBERS, POINTS


def test_groups_hold_the_places_of_the_points_of_each_on_the_others():
    shapes = [sampled(lamp(n), f"lamp{n}", n) for n in range(3)]
    told = []
    groups = synchronized_groups(load_model("general"), shapes, 0, lambda *n: told.append(n))
    assert groups.points.shape == (45, MEMBERS, MEMBERS * POINTS, 3)
    assert groups.exists.shape == groups.points.shape[:3] and told[-1] == (3, 3)
    own = np.arange(MEMBERS)[:, None] * POINTS + np.arange(POINTS)
    for member in range(MEMBERS):
        assert groups.exists[:, member, own[member]].all()
    assert groups.exists.mean() > 0.7
    assert np.allclose(np.linalg.norm(groups.normals.astype(float), axis=-1), 1, atol=0.01)


def test_a_way_that_is_wrong_is_outvoted():
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3))

    class Anywhere:
        normals = np.tile([0.0, 1.0, 0.0], (1, 1))

        def distance(self, points, normals):
            return np.zeros(len(points))

        def nearest(self, points, normals, count):
            return np.zeros((len(points), 1), int)

    def same(points):
        return points

    maps = {(one, other): same for one in range(5) for other in range(5) if one != other}
    maps[0, 1] = lambda points: points + 0.3
    maps[1, 0] = lambda points: points - 0.3  # comes back, and is wrong all the same
    place, _, exists = synchronized._place(maps, Anywhere(), 0, 1, points, points)
    assert np.abs(place - points).max() < 0.01 and not exists.any()  # they do not agree


@pytest.mark.parametrize("count", [3, 16, 17, 40])
def test_every_object_is_in_a_set(count):
    sets = synchronized._draw_sets(count, np.random.default_rng(0))
    assert set(np.concatenate(sets)) == set(range(count))
    assert max(len(one) for one in sets) <= synchronized.AT_ONCE
