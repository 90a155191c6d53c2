"""Every metric against its definition, written out over all distances."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.io.cloud import PointCloud
from nrdf_benchmark import metrics
from nrdf_benchmark.bsrc.dataset import OPPOSITE_SIDES, ROIS, BenchmarkObject
from nrdf_benchmark.metrics import (
    METRICS,
    chamfer_l1,
    defined_for,
    directed,
    f_score,
    halved_chamfer,
    opposite_of,
    overlap,
    score,
    side_accuracy,
    squared_chamfer,
)


def test_two_points_by_hand():
    a, b = np.array([[0.0, 0, 0]]), np.array([[1.0, 2, -2]])
    assert chamfer_l1(a, b) == pytest.approx(10.0)  # 1 + 2 + 2, both ways
    assert halved_chamfer(directed(a, b)) == pytest.approx(3.0)
    assert squared_chamfer(directed(a, b)) == pytest.approx(18.0)
    both = np.concatenate([a, b])
    assert chamfer_l1(a, both) == pytest.approx(2.5)  # 0 one way, the mean of 0 and 5 the other
    assert chamfer_l1(both, a) == pytest.approx(2.5)
    assert chamfer_l1(both, both) == 0.0


def test_the_nearest_neighbour_is_nearest_in_the_manhattan_distance():
    # Manhattan: 1.0 and 0.9; Euclidean: 0.58 and 0.9
    others = np.array([[1 / 3, 1 / 3, 1 / 3], [0.9, 0, 0]])
    assert chamfer_l1(np.zeros((1, 3)), others) == pytest.approx(0.9 + (1.0 + 0.9) / 2)


def test_repeated_points_count_as_often():
    truth = np.zeros((1, 3))
    found = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0]])
    assert chamfer_l1(found, truth) == pytest.approx(2 / 3)
    assert f_score(directed(found, truth), 0.1) == pytest.approx(2 * (1 / 3) / (4 / 3))


@pytest.mark.parametrize("seed", range(5))
def test_distances_equal_all_distances(seed):
    rng = np.random.default_rng(seed)
    found, truth = rng.normal(size=(rng.integers(1, 80), 3)), rng.normal(size=(70, 3))
    offset = found[:, None] - truth
    manhattan, euclidean = np.abs(offset).sum(-1), np.sqrt((offset**2).sum(-1))
    expected = manhattan.min(1).mean() + manhattan.min(0).mean()
    assert chamfer_l1(found, truth) == pytest.approx(expected, abs=1e-9)
    measured = directed(found, truth)
    expected = 0.5 * euclidean.min(1).mean() + 0.5 * euclidean.min(0).mean()
    assert halved_chamfer(measured) == pytest.approx(expected, abs=1e-9)
    expected = (euclidean**2).min(1).mean() + (euclidean**2).min(0).mean()
    assert squared_chamfer(measured) == pytest.approx(expected, abs=1e-9)
    for threshold in (1e-9, 0.3, 0.6, 9.0):
        precision = np.mean([min(row) < threshold for row in euclidean])
        recall = np.mean([min(column) < threshold for column in euclidean.T])
        both = precision + recall
        expected = 2 * precision * recall / both if both else 0.0
        assert f_score(measured, threshold) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_overlap_equals_that_of_sets(seed):
    rng = np.random.default_rng(seed)
    found, truth = rng.integers(0, 60, 50), np.unique(rng.integers(0, 60, 30))
    a, b = set(found.tolist()), set(truth.tolist())
    expected = (len(a & b) / len(a), len(a & b) / len(b), len(a & b) / len(a | b))
    assert overlap(found, truth) == pytest.approx(expected, abs=1e-9)


def test_an_empty_set_has_no_distance():
    with pytest.raises(ValueError, match="0 points from 3"):
        chamfer_l1(np.zeros((0, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="3 points from 0"):
        directed(np.zeros((3, 3)), np.zeros((0, 3)))


def plate(thickness=0.01, side=21):
    """Points and normals of a thin upright plate's front (+X) and back, and a point far off."""
    grid = np.stack(np.meshgrid(np.linspace(0, 0.4, side), np.linspace(0, 0.4, side)), -1)
    flat = grid.reshape(-1, 2)
    count = len(flat)
    front = np.c_[np.full(count, thickness / 2), flat]
    back = np.c_[np.full(count, -thickness / 2), flat]
    points = np.concatenate([front, back, [[2.0, 0, 0]]])
    normals = np.zeros_like(points)
    normals[:count, 0], normals[count:, 0] = 1, -1
    return points, normals, count


def test_sides_of_a_thin_plate():
    points, normals, count = plate()
    # Only the plate's middle is labelled.
    middle = np.flatnonzero((np.abs(points[:count, 1:] - 0.2) < 0.15).all(axis=1))
    front, back = middle, middle + count
    everywhere = np.arange(count)

    def accuracy(found):
        return side_accuracy(points, normals, np.asarray(found), front, back)

    assert accuracy(everywhere) == 1.0  # unlabelled points of the front are on the front, too
    assert accuracy(everywhere + count) == 0.0
    assert accuracy(np.r_[front, back[: len(back) // 2]]) == pytest.approx(
        len(front) / (len(front) + len(back) // 2)
    )
    assert accuracy([front[0], front[0], back[0]]) == pytest.approx(2 / 3)  # as often as found
    far = len(points) - 1
    assert accuracy([front[0], far]) == 1.0  # what is elsewhere says nothing about sides
    assert accuracy([far]) is None
    # Without a look at the normals a plate this thin could not be told apart by a noisy position.
    noisy = points + np.random.default_rng(0).normal(0, 0.01, points.shape)
    assert side_accuracy(noisy, normals, everywhere, front, back) == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_side_accuracy_equals_its_definition(seed):
    rng = np.random.default_rng(seed)
    points, normals = rng.uniform(0, 0.3, (200, 3)), rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    found, side, opposite = rng.integers(0, 200, 80), np.arange(30), np.arange(25, 60)
    right, counted = 0, 0
    for point in found:
        labelled = [(i, i in side) for i in sorted({*side, *opposite})]
        if min(np.linalg.norm(points[point] - points[i]) for i, _ in labelled) > 0.05:
            continue
        key = lambda item: (  # noqa: E731
            np.sum((points[point] - points[item[0]]) ** 2)  # noqa: B023
            + np.sum((0.1 * (normals[point] - normals[item[0]])) ** 2)  # noqa: B023
        )
        counted += 1
        right += min(labelled, key=key)[1]
    assert 0 < counted < 80
    measured = side_accuracy(points, normals, found, side, opposite)
    assert measured == pytest.approx(right / counted, abs=1e-9)


def target():
    """A "chair" whose backrest is a thin plate; its other regions are single rows of it."""
    points, normals, count = plate()
    truth = {roi: np.arange(21 * i, 21 * (i + 1)) for i, roi in enumerate(ROIS["chair"])}
    truth |= {"2f": np.arange(count), "2b": np.arange(count, 2 * count)}
    regions = {roi: points[indices] for roi, indices in truth.items()}
    return BenchmarkObject("chair1", PointCloud(points, normals), regions, truth, "0")


def test_a_region_has_every_metric_and_perfect_ones_if_it_is_the_true_one():
    item = target()
    for roi in ROIS["chair"]:
        found = score(item.truth[roi], item, roi, "chair")
        assert list(found) == list(METRICS)
        for name, value in found.items():
            if name == "side-accuracy" and roi not in ("2b", "2f"):
                assert value is None
            else:
                assert value == METRICS[name].higher_is_better


def test_the_wrong_side_is_near_in_distance_and_wrong_in_sets():
    item = target()
    found = score(item.truth["2f"], item, "2b", "chair")
    assert found["cd-l1"] == pytest.approx(0.02) and found["chamfer-l1"] == pytest.approx(0.01)
    assert found["squared-cd"] == pytest.approx(0.0002)
    assert found["f-score-0.02"] == 1.0 and found["iou"] == found["side-accuracy"] == 0.0


def test_what_is_found_nowhere_counts_as_missed():
    missed = score(np.zeros(0, int), target(), "2b", "chair")
    for name, value in missed.items():
        if name == "side-accuracy":
            assert value is None
        else:
            assert value == (0.0 if METRICS[name].higher_is_better else metrics.MISSED)


def test_sides_are_those_of_thin_parts_only():
    assert defined_for("side-accuracy", "chair") == ("2b", "2f")
    assert defined_for("side-accuracy", "car") == ()
    assert defined_for("side-accuracy", "plane") == ("5rt", "5rb", "6bt", "6bb")
    assert defined_for("iou", "car") == ROIS["car"]
    for category, pairs in OPPOSITE_SIDES.items():
        for first, second in pairs:
            assert opposite_of(first, category) == second
            assert opposite_of(second, category) == first
