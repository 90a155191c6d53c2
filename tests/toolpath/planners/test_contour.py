from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import disc, plate, plate_with_hole, tube
from nrdf.errors import ProcessError
from nrdf.geometry.polylines import total_length
from nrdf.toolpath.planners.contour import plan_contour, plan_edge
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def test_rings_of_a_disc_are_circles_from_the_outside_in():
    paths = plan_contour(disc(), STRATEGY)
    radius = [np.linalg.norm(path.contacts, axis=1) for path in paths]
    assert [round(float(np.mean(far)), 2) for far in radius] == [0.09, 0.07, 0.05, 0.03, 0.01]
    assert all(path.closed for path in paths)
    assert max(np.ptp(far) for far in radius) < 0.002


def test_an_edge_path_runs_around_the_border_and_the_hole():
    paths = plan_edge(plate_with_hole(), STRATEGY)
    length = sorted(total_length(path.contacts) for path in paths)
    assert len(paths) == 2 and all(path.closed for path in paths)
    assert length[1] == pytest.approx(1.4, rel=0.02)
    inner = plan_edge(plate(), replace(STRATEGY, edge_margin_m=0.02))
    assert total_length(inner[0].contacts) == pytest.approx(2 * (0.36 + 0.16), rel=0.02)


def test_a_tube_has_rings_and_two_edges():
    assert len(plan_edge(tube(), STRATEGY)) == 2
    assert all(path.closed for path in plan_contour(tube(), STRATEGY))


def test_a_margin_that_leaves_nothing_is_refused():
    with pytest.raises(ProcessError, match="edge_margin_m"):
        plan_contour(disc(), replace(STRATEGY, edge_margin_m=0.2))
