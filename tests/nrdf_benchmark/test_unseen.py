"""Unseen categories: the distance counts what is missed, and methods are compared pair by pair."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import DataError
from nrdf.field.weights import read_metadata
from nrdf.io.cloud import PointCloud
from nrdf_benchmark.unseen import (
    UNSEEN_WEIGHTS,
    UnseenObject,
    compare,
    evaluate_unseen,
    read_unseen,
    unseen_pairs,
)


def thing(name: str, shift: float, regions=("a", "b")) -> UnseenObject:
    """Ten points in a row, the first half one region, the rest another; the last counts nowhere."""
    points = np.arange(10)[:, None] * [0.1, 0, 0] + [0, shift, 0]
    halves = {"a": np.arange(5), "b": np.arange(5, 9)}
    counts = np.arange(10) < 9
    return UnseenObject(name, PointCloud(points), {name: halves[name] for name in regions}, counts)


def right(reference, regions, target):
    return dict(regions)


def nothing(reference, regions, target):
    return {name: np.zeros(0, int) for name in regions}


def one_off(reference, regions, target):
    return {name: np.asarray(at) + 1 for name, at in regions.items()}


THINGS = [thing("x", 0.0), thing("y", 0.5), thing("z", 1.0, ("b",))]


def test_the_benchmarks_weights_saw_none_of_its_categories():
    metadata = read_metadata(UNSEEN_WEIGHTS)
    assert metadata["preset"] == "general"
    assert set(metadata["shapes"]) == {"assemblies", "family chair", "ikea", "m3", "sh3d"}
    assert metadata["shapes"]["ikea"]["count"] == 26, "chairs, stools and benches alone"


def test_pairs_share_a_region_and_are_drawn_alike():
    pairs = unseen_pairs(THINGS, 100)
    assert len(pairs) == 6
    assert not unseen_pairs([thing("x", 0, ("a",)), thing("z", 0, ("b",))], 100)
    few = [(one.name, other.name) for one, other in unseen_pairs(THINGS, 3)]
    assert len(few) == 3
    assert few == [(one.name, other.name) for one, other in unseen_pairs(THINGS, 3)]


def test_what_is_right_costs_nothing_what_is_missed_one_and_ignored_points_do_not_count():
    pairs = unseen_pairs(THINGS, 100)
    methods = {"right": right, "nothing": nothing, "one off": one_off}
    done = []
    good, none, off = evaluate_unseen(methods, pairs, lambda *at: done.append(at))
    assert done[-1] == (6, 6)
    assert good.cd.max() == 0 and good.missed == 0
    assert none.cd.min() == 1.0 and none.missed == 8 and np.isnan(none.found).all()
    # The last of b's points moves to the one that counts nowhere; the first is then 0.1 off.
    assert off.cd[-1] == pytest.approx(0.1 / 4)
    beside = compare(off, none, pairs)
    assert 0.9 < beside.low <= beside.lower <= beside.high < 1.0


def test_a_category_without_objects_names_what_to_give():
    with pytest.raises(DataError, match="no objects of category sofa: give --objects"):
        read_unseen("sofa", None, None)
