"""CD-L1 in the paper's convention."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.benchmark.metrics import chamfer_l1


def test_two_points_by_hand():
    a, b = np.array([[0.0, 0, 0]]), np.array([[1.0, 2, -3]])
    assert chamfer_l1(a, b) == pytest.approx(12.0)  # 1 + 2 + 3, both ways
    both = np.concatenate([a, b])
    assert chamfer_l1(a, both) == pytest.approx(3.0)  # 0 one way, the mean of 0 and 6 the other
    assert chamfer_l1(both, a) == pytest.approx(3.0)
    assert chamfer_l1(both, both) == 0.0


def test_the_nearest_neighbour_is_nearest_in_the_manhattan_distance():
    # Manhattan: 1.0 and 0.9; Euclidean: 0.58 and 0.9
    others = np.array([[1 / 3, 1 / 3, 1 / 3], [0.9, 0, 0]])
    assert chamfer_l1(np.zeros((1, 3)), others) == pytest.approx(0.9 + (1.0 + 0.9) / 2)


def test_repeated_points_count_as_often():
    truth = np.zeros((1, 3))
    found = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    assert chamfer_l1(found, truth) == pytest.approx(2 / 3)


@pytest.mark.parametrize("seed", range(5))
def test_it_equals_all_distances(seed):
    rng = np.random.default_rng(seed)
    found, truth = rng.normal(size=(rng.integers(1, 80), 3)), rng.normal(size=(70, 3))
    distance = np.abs(found[:, None] - truth).sum(-1)
    expected = distance.min(1).mean() + distance.min(0).mean()
    assert chamfer_l1(found, truth) == pytest.approx(expected, abs=1e-9)


def test_an_empty_set_has_no_distance():
    with pytest.raises(ValueError, match="0 points from 3"):
        chamfer_l1(np.zeros((0, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="3 points from 0"):
        chamfer_l1(np.zeros((3, 3)), np.zeros((0, 3)))
