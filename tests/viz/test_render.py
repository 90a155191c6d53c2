from __future__ import annotations

import numpy as np

from nrdf.viz.render import Camera


def test_camera_axes_are_right_handed_and_show_what_is_up_as_up():
    axes = Camera(0.65, 0.38).axes()
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) > 0
    assert axes[1] @ [0, 1, 0] > 0
    # From the front right, the object's right-hand side (+Z) is on the viewer's left.
    assert axes[0] @ [0, 0, 1] < 0 < axes[2] @ [1, 0, 0]
