from __future__ import annotations

import numpy as np
import pytest

from nrdf.surface.grid import MOST_CELLS, Grid

UV = np.array([[0.0, 0.0], [0.4, 0.2]])


def test_a_grid_covers_its_points_and_a_margin():
    grid = Grid.around(UV, 0.1, 0.1)
    rows, columns = grid.shape
    assert grid.nodes.shape == (rows, columns, 2)
    np.testing.assert_allclose(grid.nodes[0, 0], [-0.1, -0.1])
    assert (grid.nodes[-1, -1] >= [0.5, 0.3]).all()


def test_a_large_grid_is_coarser_than_asked_for():
    grid = Grid.around(UV, 1e-6, 0.0)
    assert max(grid.shape) <= MOST_CELLS + 1


def test_a_linear_field_is_sampled_exactly_and_its_contours_are_straight():
    grid = Grid.around(UV, 0.05, 0.1)
    field = grid.nodes[..., 0] + 2.0 * grid.nodes[..., 1]
    places = np.random.default_rng(0).uniform(0.0, 0.2, (20, 2))
    np.testing.assert_allclose(grid.sample(field, places), places @ [1.0, 2.0])
    (line,) = grid.contours(field, 0.3)
    np.testing.assert_allclose(line @ [1.0, 2.0], 0.3)


def test_the_density_adds_up_to_the_points():
    grid = Grid.around(UV, 0.02, 0.3)
    weights = np.array([1.0, 3.0])
    total = grid.density(UV, 0.03, weights).sum() * grid.pitch**2
    assert total == pytest.approx(4.0, rel=1e-3)
