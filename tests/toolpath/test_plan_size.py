"""Planning always ends: what would never do so is told before, with what would be planned."""

from __future__ import annotations

import time

import numpy as np
import pytest

from builders.taught_box import SAND, bound_knowledge, cloud, faces
from nrdf.errors import ProcessError
from nrdf.process.check import check_knowledge
from nrdf.surface import surface as surface_module
from nrdf.surface.patch import patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.plan_size import estimate_size
from nrdf.toolpath.planner import plan
from nrdf.toolpath.size_limits import MOST_LINES, MOST_WAYPOINTS, check_passes
from nrdf.toolpath.strategy import Strategy


@pytest.fixture(scope="module")
def box():
    whole = cloud()
    return Surface(whole.points, whole.normals), faces(whole)["top"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stepover_m": 1e-9, "spacing_m": 1e-9, "tool_radius_m": 1e-9}, "waypoints on"),
        ({"stepover_m": 1e-6}, "lines would be planned on the region's 0.4"),
        ({"spacing_m": 1e-6}, "spacing_m 1e-06 (0.001 mm) and passes 1; at most 200,000 on 10,000"),
        ({"passes": 1000}, "passes 1000; at most"),
        ({"stepover_m": 1e-300, "spacing_m": 1e-300}, "give a value above 0"),
        ({"stepover_m": 1e-4, "spacing_m": 0.1, "direction": np.array([1.0, 0.0, 0.0])},
         "stepover_m 0.0001"),
        ({"trajectory": "spiral", "stepover_m": 5e-4}, "too fine for a spiral"),
        ({"trajectory": "contour", "stepover_m": 5e-4}, "too fine for a contour"),
        ({"tool_radius_m": 1e-9}, "tool.radius_m 1e-09 (1e-06 mm) does not go with"),
        ({"tool_radius_m": 1e-3, "stepover_m": 0.3}, "Give radius and stepover of one size"),
    ],
)  # fmt: skip
def test_what_would_not_end_is_refused_at_once(box, change, message):
    surface, region = box
    patches_of(surface, region)
    start = time.perf_counter()
    with pytest.raises(ProcessError) as caught:
        plan(surface, region, Strategy(**change))
    assert message in str(caught.value)
    assert time.perf_counter() - start < 2.0


@pytest.mark.parametrize("trajectory", ["raster", "cross-hatch", "spiral", "contour"])
def test_what_is_told_is_about_what_is_planned(box, trajectory):
    surface, region = box
    strategy = Strategy(trajectory, stepover_m=0.03, spacing_m=0.01, passes=2)
    told = estimate_size(patches_of(surface, region), strategy)
    work = [s for s in plan(surface, region, strategy) if s.kind == "process"]
    planned = sum(len(segment.positions) for segment in work)
    assert 0.6 * planned < told.waypoints < 1.6 * planned
    assert told.area == pytest.approx(0.5 * 0.9, rel=0.1)
    if trajectory in ("raster", "cross-hatch"):
        assert 0.4 * len(work) < told.lines < 1.5 * len(work)


def test_given_lines_are_not_driven_without_end():
    check_passes(MOST_WAYPOINTS // 10, MOST_LINES // 10, 10)
    for waypoints, lines in ((MOST_WAYPOINTS // 10 + 1, 1), (1, MOST_LINES // 10 + 1)):
        with pytest.raises(ProcessError, match=r"10 passes over .* Give fewer passes"):
            check_passes(waypoints, lines, 10)


def test_the_same_is_found_in_parts(box, monkeypatch):
    surface, _ = box
    rng = np.random.default_rng(0)
    near = surface.points[:500] + rng.normal(0, 2e-3, (500, 3))
    whole = surface.nearest(near, surface.normals[:500])
    smooth = surface.smooth_normals(near, surface.normals[:500], 0.03)
    monkeypatch.setattr(surface_module, "_AT_ONCE", 64)
    for one, other in zip(whole, surface.nearest(near, surface.normals[:500]), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    again = surface.smooth_normals(near, surface.normals[:500], 0.03)
    np.testing.assert_allclose(smooth, again, atol=1e-9)


def test_check_says_so_by_region_and_process():
    fine = {**SAND, "stepover_mm": 1e-3, "allow_unusual": True}
    (row,) = check_knowledge(bound_knowledge({"top": [fine]}))
    assert "lines would be planned" in row.fault and row.metrics is None
