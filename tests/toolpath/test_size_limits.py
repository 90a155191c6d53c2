"""Planning always ends: what would never do so is told before, with what would be planned."""

from __future__ import annotations

import time

import numpy as np
import pytest

from builders.regions_of_shapes import plate
from nrdf.errors import ProcessError
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.size_limits import MOST_LINES, MOST_WAYPOINTS, check_passes, estimate_size
from nrdf.toolpath.strategy import Strategy

REGION = plate(0.5, 0.9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stepover_m": 1e-9, "spacing_m": 1e-9, "tool_radius_m": 1e-9}, "waypoints on"),
        ({"stepover_m": 1e-6}, "lines would be planned on the region's 0.45 m²"),
        ({"spacing_m": 1e-6}, "spacing_m 1e-06 (0.001 mm) and passes 1; at most 200,000 on 10,000"),
        ({"passes": 1000}, "passes 1000; at most"),
        ({"run_off_m": 1e5}, "waypoints on"),
        ({"stepover_m": 5e-4, "spacing_m": 0.1}, "stepover_m 0.0005 (0.5 mm) is too fine for a ra"),
        ({"trajectory": "spiral", "stepover_m": 5e-4, "spacing_m": 0.1}, "too fine for a spiral"),
        ({"tool_radius_m": 1e-6}, "tool.radius_m 1e-06 (0.001 mm) does not go with"),
        ({"stepover_m": 1.1}, "stepover_m is 1.1, wider than the region, which measures 0.9 by"),
        ({"direction": np.array([0.0, 0.0, 1.0])}, "stands on the region"),
        ({"edge_margin_m": 0.3}, "edge_margin_m is 0.3, which leaves nothing of the region"),
    ],
)  # fmt: skip
def test_what_would_not_end_or_does_not_fit_is_refused_at_once(change, message):
    start = time.perf_counter()
    with pytest.raises(ProcessError) as caught:
        plan_on_mesh(REGION, Strategy(**change))
    assert message in str(caught.value)
    assert time.perf_counter() - start < 2.0


@pytest.mark.parametrize(
    "trajectory", ["raster", "plane-slices", "cross-hatch", "spiral", "contour", "edge"]
)
def test_what_is_told_is_about_what_is_planned(trajectory):
    strategy = Strategy(trajectory, stepover_m=0.03, spacing_m=0.01, passes=2, line_order="snake")
    told = estimate_size(REGION, strategy)
    work = [s for s in plan_on_mesh(REGION, strategy) if s.kind == "process"]
    planned = sum(len(segment.positions) for segment in work)
    assert 0.6 * planned < told.waypoints < 1.6 * planned
    assert told.area == pytest.approx(0.45) and told.extent == pytest.approx((0.9, 0.5))
    if trajectory in ("raster", "plane-slices", "cross-hatch"):
        assert 0.4 * len(work) < told.lines < 1.5 * len(work)


def test_given_lines_are_not_driven_without_end():
    check_passes(MOST_WAYPOINTS // 10, MOST_LINES // 10, 10)
    for waypoints, lines in ((MOST_WAYPOINTS // 10 + 1, 1), (1, MOST_LINES // 10 + 1)):
        with pytest.raises(ProcessError, match=r"10 passes over .* Give fewer passes"):
            check_passes(waypoints, lines, 10)
