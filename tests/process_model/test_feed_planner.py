"""Feeds that make a result even, within the limits."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from builders.plate_passes import passes
from nrdf.errors import ProcessError
from nrdf.process_model.cells import plate
from nrdf.process_model.feed_planner import (
    FeedLimits,
    plan_feeds,
    usual_slowness,
    within_acceleration,
)
from nrdf.process_model.moves import Moves, ToolSamples
from nrdf.process_model.result import Target
from nrdf.process_model.result_model import ResultModel
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh

GUN = SprayProfile(0.04, 0.03, 4e-7, 0.2)
TARGET, LIMITS = Target(60e-6, 6e-6), FeedLimits(0.02, 1.0, 2.0)


def a_model(edge=0.01):
    mesh = plate(0.4, 0.3, edge)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    return ResultModel.of(region, passes(np.arange(-0.192, 0.2, 0.024), 0.32), GUN)


def planned(model, limits=LIMITS):
    return plan_feeds(
        model.on_region, model.fixed, model.region_areas_m2, model.spill_m3(), TARGET.value_m,
        TARGET.tolerance_m, model.moves, limits,
    )  # fmt: skip


def test_a_plate_becomes_more_even_and_limits_hold():
    model = a_model()
    slowness = usual_slowness(
        model.on_region, model.fixed, model.region_areas_m2, TARGET.value_m, LIMITS
    )
    constant = model.measure(TARGET, np.full(len(model.moves.lengths_m), 1.0 / slowness))
    feeds = planned(model)
    found = model.measure(TARGET, feeds)
    assert found.within > 0.95 > 0.9 > constant.within
    assert found.variation < 0.6 * constant.variation
    assert feeds.min() >= LIMITS.least_m_s and feeds.max() <= LIMITS.most_m_s
    assert within_acceleration(feeds, model.moves, LIMITS) == pytest.approx(feeds, rel=1e-6)


def test_what_lines_do_not_reach_takes_nothing_out_of_the_tolerance():
    """Two cells of three get a move each; the third gets little of one move, whatever its feed."""
    matrix = csr_matrix(np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 0.4]]) * 1.5e-5)
    still = np.zeros((0, 3))
    none = ToolSamples(still, still, still, np.zeros(0), np.zeros(0, int))
    moves = Moves(
        np.full(2, 0.1), np.ones(2), np.arange(2), np.zeros(2), np.ones(2, bool), none, none,
        np.zeros(0, bool),
    )  # fmt: skip
    feeds = plan_feeds(
        matrix, np.zeros(3), np.array([1.0, 1.0, 0.5]), np.zeros(2), 60e-6, 6e-6, moves, LIMITS
    )
    film = matrix @ (1.0 / feeds)
    assert np.abs(film[:2] - 60e-6).max() < 6e-6 < 60e-6 - film[2]


def test_ten_thousand_cells_in_three_seconds():
    begin = time.process_time()
    model = a_model(0.0049)
    planned(model)
    assert model.region_cells > 9_900
    assert time.process_time() - begin < 3.0


def test_speed_rises_and_falls_with_the_acceleration_and_bends_are_slow():
    moves = Moves.of(passes([0.0], 0.1), 0.01)
    wanted = np.full(10, 1.0)
    wanted[4] = 0.1
    found = within_acceleration(wanted, moves, FeedLimits(0.01, 1.0, 1.0))
    assert found[4] == pytest.approx(0.1)
    assert np.abs(np.diff(found**2)).max() == pytest.approx(2.0 * 0.01)
    assert (found <= 1.0).all() and found[0] < found[9] < 1.0


def test_a_path_beside_its_region_is_told():
    model = a_model()
    nothing = 0.0 * model.on_region
    with pytest.raises(ProcessError, match="leaves nothing on more than half"):
        usual_slowness(nothing, model.fixed, model.region_areas_m2, 60e-6, LIMITS)


def test_limits_that_leave_no_speed_are_refused():
    with pytest.raises(ProcessError, match="give a least feed above 0"):
        FeedLimits(0.2, 0.1)
    with pytest.raises(ProcessError, match="an acceleration of 0"):
        FeedLimits(acceleration_m_s2=0.0)
