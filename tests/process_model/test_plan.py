"""Planning by the result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process_model.cells import plate
from nrdf.process_model.feed_planner import FeedLimits
from nrdf.process_model.plan import feeds_for, first_look, plan_by_result, strategies_for
from nrdf.process_model.plate_theory import best_stepover
from nrdf.process_model.removal import Pad
from nrdf.process_model.result import Target
from nrdf.process_model.result_model import ResultModel
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.strategy import Strategy

GUN = SprayProfile(0.05, 0.05, 5e-7, 0.15)
TARGET = Target(60e-6, 6e-6)
TAUGHT = Strategy(stepover_m=0.03, spacing_m=0.01, tool_radius_m=0.05, standoff_m=0.15,
                  line_order="snake", run_off_m=0.05)  # fmt: skip


@pytest.fixture(scope="module")
def region():
    mesh = plate(0.5, 0.4, 0.02)
    bent = mesh.vertices.copy()
    bent[:, 2] = 0.012 * np.cos(2.0 * np.pi * bent[:, 0] / 0.4)
    whole = type(mesh)(bent, mesh.faces)
    return RegionMesh.from_faces(whole, np.ones(len(mesh.faces), bool))


def test_a_wavy_plate_is_painted_evenly_with_less_waste(region):
    taught = plan_on_mesh(region, TAUGHT)
    made = plan_by_result(region, taught, TAUGHT, GUN, TARGET, FeedLimits())
    assert made.metrics.within > 0.95 > made.taught.within + 0.2
    assert made.metrics.variation < 0.5 * made.taught.variation
    assert made.metrics.overspray < made.taught.overspray
    again = [s for s in made.segments if s.kind == "process"]
    assert all(s.feeds_m_s is not None for s in again)


def test_a_taught_path_keeps_its_lines(region):
    taught = plan_on_mesh(region, TAUGHT)
    made = plan_by_result(region, taught, TAUGHT, GUN, TARGET, FeedLimits(), replan=False)
    for old, new in zip(taught, made.segments, strict=True):
        np.testing.assert_array_equal(old.positions, new.positions)


@pytest.mark.parametrize(("value", "said"), [(5e-3, "µm at most"), (1e-7, "less flow")])
def test_a_target_out_of_reach_says_what_is_reachable(region, value, said):
    taught = plan_on_mesh(region, TAUGHT)
    with pytest.raises(ProcessError, match=f"out of reach: at feeds of 10 to 1000 mm/s.*{said}"):
        plan_by_result(region, taught, TAUGHT, GUN, Target(value, 0.1 * value), FeedLimits())


def test_a_pad_that_does_not_turn_has_no_target(region):
    still = Pad(0.05, 2e7, 5e-9, 20.0)
    with pytest.raises(ProcessError, match="does not turn takes off the same at every feed"):
        plan_by_result(region, (), TAUGHT, still, TARGET, FeedLimits())


def test_lines_are_as_theory_has_them_farther_apart_or_as_taught():
    tried = strategies_for(TAUGHT, GUN)
    even = best_stepover(GUN)
    assert [one.stepover_m for one in tried] == pytest.approx([1.5 * even, even, 0.03])
    assert {one.run_off_m for one in tried} == {0.3 * 0.05}
    assert len(strategies_for(replace(TAUGHT, stepover_m=1.02 * even), GUN)) == 2
    pad = Pad(0.05, 2e7, 5e-9, 20.0, 1000.0, 0.0025)
    assert strategies_for(TAUGHT, pad)[0].run_off_m == TAUGHT.run_off_m
    joined = replace(TAUGHT, line_order="zigzag", join_gap_m=0.1)
    assert strategies_for(joined, pad)[0].joined_gap_m == 0.0


def test_lines_are_chosen_by_what_they_leave(region):
    """Neither the first that is tried nor the last where another one is better."""
    taught, limits = plan_on_mesh(region, TAUGHT), FeedLimits(acceleration_m_s2=0.2)
    within = {}
    for own in strategies_for(TAUGHT, GUN):
        lines = plan_on_mesh(region, own)
        model = ResultModel.of(region, lines, GUN)
        within[own.stepover_m] = model.measure(TARGET, feeds_for(model, TARGET, limits)).within
    made = plan_by_result(region, taught, TAUGHT, GUN, TARGET, limits)
    assert made.strategy.stepover_m == max(within, key=within.__getitem__)
    assert made.metrics.within == pytest.approx(max(within.values()))


def test_a_first_look_is_near_the_same_at_one_feed_in_few_cells(region):
    taught, limits = plan_on_mesh(region, TAUGHT), FeedLimits()
    look = first_look(region, taught, TAUGHT, GUN, TARGET, limits)
    whole = plan_by_result(region, taught, TAUGHT, GUN, TARGET, limits).taught
    assert look.metrics.within == pytest.approx(whole.within, abs=0.1)
    cells = look.model.cells
    assert len(cells.of_region(look.model.values())) == len(cells.fine.faces)
    assert first_look(region, taught, TAUGHT, GUN, TARGET, limits).model.cells is cells, "kept"


def test_what_is_taught_is_never_made_worse():
    """Even by theory, lines of this pad are so near each other that no feed is fast enough."""
    pad = Pad(0.025, 2e7, 5e-9, 20.0, 942.0, 0.0025)
    coarse = replace(TAUGHT, stepover_m=0.02, tool_radius_m=0.025, standoff_m=0.0, run_off_m=0.0)
    mesh = plate(0.3, 0.3, 0.02)
    flat = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    target, limits = Target(20e-6, 5e-6), FeedLimits(most_m_s=0.7)
    made = plan_by_result(flat, plan_on_mesh(flat, coarse), coarse, pad, target, limits)
    assert made.strategy.stepover_m > best_stepover(pad)
    assert made.metrics.within >= made.taught.within > 0.5
