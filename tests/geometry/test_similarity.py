"""Where canonical coordinates lie in a scan."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import CloudError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright

POINTS = np.random.default_rng(0).normal(size=(20, 3))
POSE = Similarity(rotation_about_up(0.4) @ upright(up_axis("z")), np.array([1.0, -2.0, 3.0]), 0.5)


def test_there_and_back():
    np.testing.assert_allclose(POSE.to_canonical(POSE.to_scan(POINTS)), POINTS, atol=1e-12)


def test_the_matrix_takes_scaled_canonical_points_to_the_scan():
    whole = np.c_[POSE.scale * POINTS, np.ones(len(POINTS))] @ POSE.T_scan_canonical.T
    np.testing.assert_allclose(whole[:, :3], POSE.to_scan(POINTS), atol=1e-12)


def test_one_after_the_other():
    other = Similarity(rotation_about_up(-1.2), np.array([0.0, 5.0, 0.0]), 3.0)
    together = POSE.then(other)
    np.testing.assert_allclose(together.to_scan(POINTS), other.to_scan(POSE.to_scan(POINTS)))


def test_upright_and_axes():
    for name in ("x", "y", "z", "-x", "-y", "-z", "1 2 3"):
        up = up_axis(name)
        rotation = upright(up)
        np.testing.assert_allclose(rotation @ [0, 1, 0], up, atol=1e-12)
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1)
    np.testing.assert_allclose(upright(up_axis("y")), np.eye(3))
    for wrong in ("w", "0 0 0", "1 2", "+z"):
        with pytest.raises(CloudError, match="no direction; give one of x, y"):
            up_axis(wrong)
