"""A line through the origin, the others at whole stepovers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.regions_of_shapes import plate, tube
from nrdf.toolpath.planners import PLANNERS
from nrdf.toolpath.planners.field_lines import parts_of
from nrdf.toolpath.planners.origin import levels_through, value_at
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(
    stepover_m=0.03, spacing_m=0.01, tool_radius_m=0.03, direction=np.array([1.0, 0.0, 0.0])
)


def heights(paths):
    return sorted({round(float(y), 6) for path in paths for y in path.contacts[:, 1]})


@pytest.mark.parametrize("trajectory", ["raster", "plane-slices"])
@pytest.mark.parametrize("origin", [(0.1, 0.055, 0.0), (-3.0, 0.055 + 7 * 0.03, 0.4)])
def test_lines_of_a_plate_lie_at_whole_stepovers_from_the_origin_also_beyond_it(trajectory, origin):
    found = PLANNERS[trajectory](plate(), replace(STRATEGY, origin_m=np.array(origin)))
    assert heights(found) == pytest.approx(np.arange(0.025, 0.2, 0.03), abs=1e-5)
    evenly = PLANNERS[trajectory](plate(), STRATEGY)
    assert 0.055 not in np.round(heights(evenly), 3)


def test_a_cross_hatch_crosses_in_the_origin():
    origin = np.array([0.11, 0.055, 0.0])
    found = PLANNERS["cross-hatch"](plate(), replace(STRATEGY, origin_m=origin))
    for axis in (0, 1):
        on = [p for p in found if np.ptp(p.contacts[:, axis]) < 1e-6]
        off = (np.array([p.contacts[0, axis] for p in on]) - origin[axis]) / 0.03
        assert len(on) > 5 and np.abs(off - off.round()).max() < 1e-3


def test_a_line_of_a_curved_part_passes_through_the_origin():
    region = tube()
    place = region.mesh.vertices[len(region.mesh.vertices) // 3]
    along = replace(STRATEGY, direction=None, stepover_m=0.01, tool_radius_m=0.01, origin_m=place)
    found = PLANNERS["plane-slices"](region, along)
    contacts = np.concatenate([path.contacts for path in found])
    assert np.linalg.norm(contacts - place, axis=1).min() < 0.006  # half a spacing, along a line


def test_a_ring_has_no_origin():
    rings = replace(STRATEGY, trajectory="contour")
    moved = replace(rings, origin_m=np.array([0.1, 0.05, 0.0]))
    one, other = (PLANNERS["contour"](plate(), s) for s in (rings, moved))
    assert len(one) == len(other)


def test_the_value_goes_on_beyond_the_mesh():
    (part,) = parts_of(plate(), STRATEGY)
    height = part.mesh.vertices[:, 1]
    assert value_at(part.mesh, height, np.array([0.1, 0.05, 0.0])) == pytest.approx(0.05)
    assert value_at(part.mesh, height, np.array([9.0, -2.0, 1.0])) == pytest.approx(-2.0)


def test_what_the_tool_would_not_reach_at_an_end_gets_a_line_more():
    # 0.02 are left below and 0.09 above: more than the tool reaches from the outermost lines.
    made = levels_through(0.02, 0.0, 1.0, 0.1, 0.1)
    assert made == pytest.approx(np.arange(10) * 0.1 + 0.02)
    made = levels_through(0.02, 0.0, 1.0, 0.1, 0.06)
    assert made == pytest.approx([*(np.arange(10) * 0.1 + 0.02), 0.96])
    assert levels_through(0.0, 0.0, 0.2, 0.1, 0.1) == pytest.approx([0.002, 0.1, 0.198])
    assert levels_through(5.0, 0.02, 0.06, 0.1, 0.1) == pytest.approx([0.04])
