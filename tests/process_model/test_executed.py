"""What a recorded motion leaves, beside what the same tool path leaves by its moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builders.plate_passes import FEED, passes
from nrdf.process_model.cells import plate
from nrdf.process_model.executed import ExecutedMotion, executed_values, measure_executed
from nrdf.process_model.removal import Pad
from nrdf.process_model.result import Target
from nrdf.process_model.result_model import ResultModel
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh

GUN = SprayProfile(0.04, 0.03, 4e-7, 0.2)
PAD = Pad(0.04, 2e7, 5e-9, 20.0, 1000.0, 0.0025)


def model_and_motion(tool, height):
    """A pass over a plate: its model, and the motion of a tool that keeps to it."""
    mesh = plate(0.3, 0.3, 0.02)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    model = ResultModel.of(region, passes([0.0], 0.2, height), tool)
    given = model.moves.samples
    timed = replace(given, weights=given.weights / FEED, column=np.zeros(len(given.places), int))
    count = len(given.places)
    return model, ExecutedMotion(timed, np.full(count, FEED), np.full(count, 20.0)), mesh


@pytest.mark.parametrize(("tool", "height"), [(GUN, 0.2), (PAD, 0.0)])
def test_a_motion_as_planned_leaves_what_was_planned(tool, height):
    model, motion, mesh = model_and_motion(tool, height)
    values = executed_values(model.cells, motion, tool, mesh)
    assert values == pytest.approx(model.values(), abs=1e-9 * values.max())
    target = Target(30e-6, 5e-6)
    done = measure_executed(model.cells, values, motion, tool, target)
    planned = model.measure(target)
    assert done.within == planned.within and done.seconds == pytest.approx(planned.seconds)
    assert done.overspray == pytest.approx(planned.overspray, abs=1e-6)


def test_where_the_tool_waits_there_is_more():
    model, motion, mesh = model_and_motion(GUN, 0.2)
    times = motion.samples.weights.copy()
    times[len(times) // 2] += 1.0
    waited = replace(motion, samples=replace(motion.samples, weights=times))
    more = executed_values(model.cells, waited, GUN, mesh) - model.values()
    assert model.cells.areas_m2 @ more == pytest.approx(GUN.flow_m3_s, rel=0.02)
    assert np.linalg.norm(model.cells.centres[np.argmax(more)]) < 0.02


def test_the_force_that_was_there_counts():
    model, motion, mesh = model_and_motion(PAD, 0.0)
    half = executed_values(model.cells, replace(motion, force_n=0.5 * motion.force_n), PAD, mesh)
    assert half == pytest.approx(0.5 * model.values(), rel=0.01, abs=1e-9)
    lifted = replace(motion, force_n=0.0 * motion.force_n)
    assert not executed_values(model.cells, lifted, PAD, mesh).any()
