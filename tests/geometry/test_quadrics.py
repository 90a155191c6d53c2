"""Quadrics: exact where the points lie on one, flat where they do not say."""

import numpy as np

from nrdf.geometry.quadrics import quadric_normals, quadrics


def test_a_quadric_is_fitted_exactly():
    rng = np.random.default_rng(0)
    offset = rng.uniform(-2, 2, (5, 30, 2))
    x, y = offset[..., 0], offset[..., 1]
    values = 3 + 2 * x - y + 0.5 * x**2 - x * y + y**2
    found = quadrics(offset, values[..., None], np.ones((5, 30)))[..., 0]
    np.testing.assert_allclose(found, np.tile([3, 2, -1, 1, -1, 2], (5, 1)), atol=0.03)


def test_curvature_that_one_line_of_points_does_not_fix_is_small():
    along = np.linspace(-1.0, 1.0, 9)
    offset = np.stack([along, np.zeros(9)], axis=1)[None]
    found = quadrics(offset, (0.5 * along)[None, :, None], np.ones((1, 9)))[0, :, 0]
    np.testing.assert_allclose(found, [0.0, 0.5, 0.0, 0.0, 0.0, 0.0], atol=1e-3)


def test_normals_of_a_slope_lean_against_it():
    found = quadric_normals(np.array([[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [[-np.sqrt(0.5), 0.0, np.sqrt(0.5)]])
