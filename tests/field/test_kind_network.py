"""The network that tells the kind of object: alike in every turn, left for right."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.step_shape import step_shape
from nrdf.field.kind_network import (
    ASKEW,
    ORIENTATIONS,
    OTHER,
    TILTED,
    UPS,
    KindNetwork,
    orientation_of,
    up_of,
)
from nrdf.geometry.canonical import rotation_about_up


def test_the_orientations_are_the_rotations_of_a_cube():
    assert len({tuple(o.ravel()) for o in ORIENTATIONS}) == 24
    assert np.allclose(np.linalg.det(ORIENTATIONS), 1) and np.allclose(ORIENTATIONS[0], np.eye(3))
    assert [orientation_of(o) for o in ORIENTATIONS] == list(range(24))
    assert np.allclose(up_of(ASKEW + 5), [0, 0, -1])
    assert up_of(TILTED) is None and up_of(OTHER) is None and np.allclose(up_of(0), [0, 1, 0])


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turned_or_mirrored_cloud_is_told_alike(side):
    torch.manual_seed(3)
    network = KindNetwork().eval()
    shape = step_shape("", 0)
    points = np.random.default_rng(0).permutation(shape.surface_points)[:384]
    told = network.probabilities(points)
    assert told.sum() == pytest.approx(1, abs=1e-5)
    mirror = np.diag([1.0, 1.0, side])
    moved = rotation_about_up(np.pi / 2) @ mirror
    again = network.probabilities(7 * points @ moved.T + 3)
    for answer, rotation in enumerate(ORIENTATIONS):
        there = orientation_of(moved @ rotation @ mirror)
        assert again[there] == pytest.approx(told[answer], abs=1e-4)
    for answer, up in enumerate(UPS):
        there = int((UPS @ (moved @ up)).argmax())
        assert again[ASKEW + there] == pytest.approx(told[ASKEW + answer], abs=1e-4)
    assert again[OTHER] == pytest.approx(told[OTHER], abs=1e-4)


def test_few_points_are_enough():
    assert KindNetwork().eval().probabilities(np.random.default_rng(0).normal(size=(100, 3))).shape
