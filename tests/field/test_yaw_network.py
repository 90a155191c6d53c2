"""The network that tells yaw: alike in every turn, left for right; what ships."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from builders.step_shape import step_cloud
from nrdf.field import yaw_network as yaws
from nrdf.field.yaw_network import YawNetwork, log_probability_at, yaw_rotations
from nrdf.field.zoo import list_models
from nrdf.geometry.canonical import MIRROR, rotation_about_up


def network() -> YawNetwork:
    torch.manual_seed(3)
    return YawNetwork().eval()


def test_a_turned_cloud_has_turned_yaws_and_a_mirrored_one_mirrored_ones():
    points, normals = step_cloud()
    asked = network()
    told = asked.log_probability(points, normals)
    assert np.exp(told).sum() == pytest.approx(1, abs=1e-5)
    turned = rotation_about_up(np.radians(60))
    again = asked.log_probability(7 * points @ turned.T + 3, normals @ turned.T)
    np.testing.assert_allclose(again, np.roll(told, 6), atol=1e-4)
    mirrored = asked.log_probability(points * MIRROR, normals * MIRROR)
    np.testing.assert_allclose(mirrored, np.roll(told[::-1], 1), atol=1e-4)


def test_few_points_are_enough():
    points, normals = step_cloud()
    assert network().log_probability(points[:100], normals[:100]).shape == (36,)


def test_between_its_bins_a_distribution_is_interpolated():
    told = np.full(36, -5.0)
    told[[0, 35]] = -1.0, -2.0
    found = log_probability_at(told, np.radians([0.0, -5.0, 355.0, 10.0, 365.0]))
    np.testing.assert_allclose(found, [0, -0.5, -0.5, -4, -2])


def test_turning_is_about_up_as_elsewhere():
    np.testing.assert_allclose(yaw_rotations(torch.tensor(0.7)), rotation_about_up(0.7), atol=1e-6)


def test_what_ships_is_whole_and_small():
    shipped = list_models(yaws.YAW_ZOO)
    assert {"car", "plane"} <= {entry.name for entry in shipped}
    for entry in shipped:
        found = yaws.find_yaw_network(entry.category)
        assert found is not None and found.config.bins % 12 == 0
        assert entry.bytes < 500_000 and entry.scores["wrong-yaws"] < 0.1
