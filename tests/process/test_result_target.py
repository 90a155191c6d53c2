"""A process with a target, planned by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.errors import ProcessError
from nrdf.process.process import Process
from nrdf.process.result_target import (
    plan_result,
    result_settings,
    result_warnings,
    with_lines_of,
)
from nrdf.process.strategy import strategy_of
from nrdf.process_model.cells import plate
from nrdf.process_model.removal import Pad
from nrdf.process_model.spray_profile import SprayProfile
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh

from .test_result_keys import PAINT, SAND


@pytest.fixture(scope="module")
def region():
    mesh = plate(0.4, 0.3, 0.03)
    return RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))


def planned(region, content):
    process = Process.model_validate(content)
    return process, plan_result(region, process, plan_on_mesh(region, strategy_of(process)), True)


def test_a_gun_and_a_pad_are_made_of_the_keys():
    gun = result_settings(Process.model_validate({**PAINT, "thickness_um": "60 ± 6"}))
    assert gun.tool == SprayProfile(0.05, 0.04, 4e-7, 0.15)
    assert gun.target.value_m == pytest.approx(60e-6)
    pad = result_settings(Process.model_validate({**SAND, "removal_um": "30 ± 5"}))
    assert replace(pad.tool, spindle_rad_s=0.0) == Pad(0.05, 2e7, 5e-9, 20.0, 0.0, 0.0025)
    assert pad.tool.spindle_rad_s == pytest.approx(300.0 * np.pi)
    assert result_settings(Process.model_validate(PAINT)) is None


def test_paint_and_sanding_hold_their_targets(region):
    process, made = planned(region, {**PAINT, "thickness_um": "60 ± 6"})
    assert made.metrics.within > 0.95 and result_warnings(process, made) == []
    changed = with_lines_of(process, made)
    assert changed.stepover_m < process.stepover_m and changed.run_off_m > 0.0
    process, made = planned(region, {**SAND, "removal_um": "20 ± 5"})
    assert made.metrics.within > 0.95 > 0.8 > made.taught.within
    assert with_lines_of(process, made).line_order == "snake"
    assert planned(region, PAINT)[1] is None


def test_sanding_through_and_a_missed_tolerance_are_warned_of(region):
    amount = {"value": 20, "tolerance": 0.5, "most": 21}
    process, made = planned(region, {**SAND, "removal_um": amount})
    missed, through = result_warnings(process, made)
    assert "of the region will have 20 ± 0.5 µm" in missed
    assert "of the region is sanded through: more than 21 µm" in through


def test_what_is_out_of_reach_is_told_by_its_key(region):
    with pytest.raises(ProcessError, match="thickness_um: a target of 5000 µm is out of reach"):
        planned(region, {**PAINT, "thickness_um": "5000 ± 10"})
