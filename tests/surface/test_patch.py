"""Regions cut into patches, and the surface over them."""

from __future__ import annotations

import numpy as np
import pytest

from builders.surfaces import board, dome, slats, tube, two_sided
from nrdf.errors import ProcessError
from nrdf.surface.border import CONTEXT, OTHER, OWN
from nrdf.surface.patch import patches_of
from nrdf.surface.surface import Surface


def whole(surface: Surface) -> np.ndarray:
    return np.arange(len(surface.points))


def test_a_flat_region_is_one_patch_with_its_surroundings():
    points, normals = board()
    surface = Surface(points, normals)
    region = np.flatnonzero(points[:, 0] < 0.2)
    (patch,) = patches_of(surface, region)
    assert set(patch.index[patch.label == OWN]) == set(region)
    around = patch.points[patch.label == CONTEXT]
    assert len(around) and (around[:, 0] >= 0.2).all() and (around[:, 0] < 0.26).all()
    assert patches_of(surface, region[::-1])[0] is patch


def test_a_closed_tube_is_cut_lengthwise_and_every_point_is_some_patchs_own():
    surface = Surface(*tube(radius=0.04))
    patches = patches_of(surface, whole(surface))
    assert 2 <= len(patches) <= 4
    own = np.concatenate([patch.index[patch.label == OWN] for patch in patches])
    assert len(own) == len(set(own)) > 0.98 * len(surface.points)
    assert all(np.ptp(patch.points[:, 2]) > 0.25 for patch in patches)
    assert all((patch.label == OTHER).any() for patch in patches)


def test_the_sides_of_a_thin_board_are_two_patches():
    surface = Surface(*two_sided())
    patches = patches_of(surface, whole(surface))
    assert len(patches) == 2
    for patch in patches:
        assert np.ptp(patch.points[:, 2]) == 0.0


def test_slats_that_hang_together_are_one_patch():
    surface = Surface(*slats())
    assert len(patches_of(surface, whole(surface))) == 1


def test_the_surface_is_smooth_and_its_derivatives_are_tangents():
    surface = Surface(*dome())
    (patch,) = patches_of(surface, whole(surface))
    middle = patch.uv[np.linalg.norm(patch.uv, axis=1) < 0.15]
    places, along = patch.at(middle + 0.002)
    assert np.abs(np.linalg.norm(places, axis=1) - 0.25).max() < 1e-3
    outward = np.cross(along[:, 0], along[:, 1])
    assert (np.einsum("na,na->n", outward, places) > 0.2).all()
    step = 1e-5
    ahead = patch.at(middle + np.array([0.002 + step, 0.002]))[0]
    assert np.quantile(np.linalg.norm((ahead - places) / step - along[:, 0], axis=1), 0.9) < 0.1
    smooth = patch.smooth_normals(middle, 0.03)
    np.testing.assert_allclose(np.einsum("na,na->n", smooth, places) / 0.25, 1.0, atol=0.01)


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.2])
def test_the_extent_follows_the_longest_side(turn):
    points, normals = board(length=0.4, width=0.2)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    surface = Surface(points @ rotation.T, normals)
    (patch,) = patches_of(surface, whole(surface))
    length, width, angle = patch.extent
    assert (length, width) == pytest.approx((0.4, 0.2), abs=0.02)
    wanted, share = patch.angle_of(rotation[:, 0])
    assert share == pytest.approx(1.0)
    assert abs(np.sin(angle - wanted)) < 0.03


def test_a_direction_off_the_surface_has_a_small_share():
    surface = Surface(*board())
    (patch,) = patches_of(surface, whole(surface))
    assert patch.angle_of(np.array([0.0, 0.0, 2.0]))[1] < 1e-9


def test_a_region_of_too_few_points_is_refused():
    with pytest.raises(ProcessError, match="3 points are too few or too scattered"):
        patches_of(Surface(*board()), np.array([0, 1, 2]))
