from __future__ import annotations

import numpy as np

from nrdf.viz.view import OVERSAMPLING, Camera, eye_dome, reduced


def test_a_pixel_is_the_mean_of_its_fine_ones_and_stays_in_range():
    fine = np.zeros((2 * OVERSAMPLING, OVERSAMPLING, 3), np.float32)
    fine[0] = 1.0
    fine[OVERSAMPLING:] = 3.0
    np.testing.assert_allclose(reduced(fine)[:, 0, 0], [1.0 / OVERSAMPLING, 1.0])


def test_only_what_is_just_behind_something_nearer_is_darker():
    depth = np.zeros((20, 20))
    depth[:, :8] = -1.5  # the background
    depth[:, 14:] = 0.3
    factor = eye_dome(depth, 1)
    assert (factor[5:15, :8] == 1.0).all() and (factor[5:15, 9:11] == 1.0).all()
    assert (factor[5:15, 13] < 0.9).all() and (factor[5:15, 15:18] == 1.0).all()


def test_camera_axes_are_right_handed_and_show_what_is_up_as_up():
    axes = Camera(0.65, 0.38).axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) > 0
    assert axes[1] @ [0, 1, 0] > 0
    # From the front right, the object's right-hand side (+Z) is on the viewer's left.
    assert axes[0] @ [0, 0, 1] < 0 < axes[2] @ [1, 0, 0]


def test_a_region_is_looked_at_from_its_side():
    for normal in ([0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]):
        assert Camera.towards(np.array(normal)).axes()[2] @ normal > 0.7
