"""A scan of a chair in any pose, on a floor."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.bundled import bundled_chair
from nrdf.io.cloud import PointCloud

ANY = Rotation.from_euler("xyz", [90, 0, 40], degrees=True).as_matrix()
"""From the chair's axes to the scan's."""


def lying_scan(count=2500, unit="mm"):
    """A bundled chair that lies anywhere on a floor, in millimetres; the chair's points first."""
    chair = 1e3 * bundled_chair("ladder-back")[0].points[:count]
    chair[:, 1] -= chair[:, 1].min()
    rng = np.random.default_rng(0)
    floor = np.zeros((1500, 3))
    floor[:, 0], floor[:, 2] = rng.uniform(-900, 900, (2, 1500))
    return PointCloud(np.concatenate([chair, floor]) @ ANY.T + [2e3, 50.0, -400.0], unit=unit)
