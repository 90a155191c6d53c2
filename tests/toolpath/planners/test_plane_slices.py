from dataclasses import replace

import numpy as np

from builders.regions_of_shapes import cap, plate
from nrdf.toolpath.planners.plane_slices import plan_plane_slices
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def test_slices_of_a_plate_are_its_raster():
    assert len(plan_plane_slices(plate(), STRATEGY)) == 10


def test_slices_lie_in_planes_one_stepover_apart():
    paths = plan_plane_slices(cap(), replace(STRATEGY, direction=np.array([1.0, 0.0, 0.0])))
    assert max(np.ptp(path.contacts[:, 1]) for path in paths) < 1e-9
    apart = np.diff(sorted(path.contacts[0, 1] for path in paths))
    assert (apart > 0.0179).all() and (apart < 0.0201).all()
    # Along the sphere the outer ones are farther apart than that: what the raster avoids.
    far = np.sort([0.2 * np.arcsin(path.contacts[0, 1] / 0.2) for path in paths])
    assert np.diff(far).max() > 1.25 * 0.02
