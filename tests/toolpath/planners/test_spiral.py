from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import cap, disc, plate, plate_with_hole
from nrdf.errors import ProcessError
from nrdf.geometry.polylines import longest_step, total_length
from nrdf.toolpath.planners.spiral import plan_spiral
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


@pytest.mark.parametrize("region", [disc(), plate(), cap()])
def test_a_disc_like_region_is_one_stroke(region):
    (path,) = plan_spiral(region, STRATEGY)
    assert longest_step(path.contacts) <= 2 * STRATEGY.spacing_m
    assert region.mesh.nearest(path.contacts).distances.max() < 1e-7
    # Rings and one turn from each to the next: about one ring longer than the rings.
    assert 1.0 < total_length(path.contacts) * 0.02 / region.area_m2 < 1.45


def test_a_discs_spiral_goes_inward_evenly():
    (path,) = plan_spiral(disc(), STRATEGY)
    far = np.linalg.norm(path.contacts[:, :2], axis=1)
    assert far[0] == pytest.approx(0.09, abs=0.002) and far[-1] == pytest.approx(0.01, abs=0.003)
    assert np.diff(far).max() < 0.002
    angle = np.unwrap(np.arctan2(path.contacts[:, 1], path.contacts[:, 0]))
    turn = 2 * np.pi * np.sign(angle[-1] - angle[0])
    order = np.argsort(angle)
    later = np.interp(angle + turn, angle[order], far[order], left=np.nan, right=np.nan)
    middle = (far < 0.069) & (far > 0.031) & np.isfinite(later)
    np.testing.assert_allclose((far - later)[middle], 0.02, atol=0.003)


def test_around_a_hole_there_are_few_strokes_and_a_margin_is_checked():
    paths = plan_spiral(plate_with_hole(), STRATEGY)
    assert 2 <= len(paths) <= 6
    assert max(longest_step(path.contacts) for path in paths) <= 2 * STRATEGY.spacing_m
    with pytest.raises(ProcessError, match="edge_margin_m"):
        plan_spiral(disc(), replace(STRATEGY, edge_margin_m=0.2))
