"""Where regions end."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import SPACING, board, slats
from nrdf.surface.border import CONTEXT, OTHER, OWN, Border


def area(border: Border) -> float:
    inside = border.clearance(border.grid.nodes, 0.0) > 0.0
    return float(inside.sum() * border.grid.pitch**2)


def labelled(points: np.ndarray) -> Border:
    return Border(points[:, :2], np.full(len(points), OWN), SPACING)


@pytest.mark.parametrize("seed", range(4))
def test_a_randomly_sampled_board_is_whole_and_as_large_as_it_is(seed):
    border = labelled(board(seed=seed)[0])
    assert area(border) == pytest.approx(0.12, rel=0.03)
    inner = np.stack(np.meshgrid(np.linspace(0.03, 0.37, 80), np.linspace(0.03, 0.27, 60)), -1)
    assert (border.distance(inner) > 0.0).all()


def test_distances_from_the_border_are_known_to_half_the_spacing():
    border = labelled(board()[0])
    places = np.random.default_rng(0).uniform([0.0, 0.0], [0.4, 0.3], (500, 2))
    exact = np.minimum(places, [0.4, 0.3] - places).min(axis=1)
    error = border.distance(places) - exact
    assert np.abs(error).mean() < 0.5 * SPACING
    outside = np.array([[-0.03, 0.15], [0.2, 0.33]])
    np.testing.assert_allclose(border.distance(outside), [-0.03, -0.03], atol=SPACING)
    assert border.deepest == pytest.approx(0.15, abs=SPACING)


def test_a_gap_that_is_wider_than_chance_leaves_is_a_hole():
    border = labelled(slats(gap=0.04)[0])
    through = np.c_[np.full(20, 0.2), np.linspace(0.08, 0.22, 20)]
    assert (border.distance(through) < 0.0).all()
    assert area(border) == pytest.approx(0.12 - 0.04 * 0.2, rel=0.03)


def test_a_stray_point_without_the_label_makes_no_hole():
    points, _ = board()
    label = np.full(len(points), OWN)
    middle = np.linalg.norm(points[:, :2] - [0.2, 0.15], axis=1).argmin()
    label[middle] = CONTEXT
    border = Border(points[:, :2], label, SPACING)
    assert border.distance(points[[middle], :2])[0] > 0.1


def test_the_region_ends_half_way_between_the_labels():
    points, _ = board()
    border = Border(points[:, :2], np.where(points[:, 0] < 0.25, OWN, CONTEXT), SPACING)
    across = np.c_[np.linspace(0.2, 0.3, 101), np.full(101, 0.15)]
    end = across[border.distance(across) > 0.0, 0].max()
    assert end == pytest.approx(0.25, abs=0.6 * SPACING)


def test_a_seam_ends_the_patch_but_is_no_border():
    points, _ = board()
    border = Border(points[:, :2], np.where(points[:, 0] < 0.2, OWN, OTHER), SPACING)
    near_seam = np.array([[0.18, 0.15], [0.23, 0.15]])
    assert (border.distance(near_seam) > 0.1).all()
    own, beyond = border.clearance(near_seam, 0.05)
    assert own == pytest.approx(0.02, abs=SPACING) and beyond < -0.02
