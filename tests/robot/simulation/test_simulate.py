from __future__ import annotations

import numpy as np
import pytest

from builders.arm_cells import PLATE_PLACE
from builders.plate_job import turned_job
from nrdf.errors import RobotError
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.robot.model.cell import Placement
from nrdf.robot.report.content import simulation_report
from nrdf.robot.simulation.job import read_simulation_job
from nrdf.robot.simulation.simulate import simulate


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.0, 0.005, 0.0), (0.0, -0.005, 0.0)])
def test_force_is_kept_on_an_object_that_is_5_mm_off(plate_job, arm, plate, shift):
    done = plate
    if any(shift):
        job = read_simulation_job(plate_job)
        done = simulate(job, arm, placement=PLATE_PLACE, shift_m=shift)
    out = done.paths[0].metrics
    assert out.reached == out.waypoints == 27
    assert out.force_within is not None and out.force_within > 0.95
    assert out.achieved.worked == pytest.approx(out.planned.worked, abs=0.03)
    for found in (out.planned, out.executed, out.achieved):
        assert found.worked + sum(found.left_out.values()) + found.unreached == pytest.approx(1.0)
    # Three lines do not work the whole plate.
    assert out.achieved.unreached == pytest.approx(0.6, abs=0.03)
    assert not done.paths[0].collisions


def test_a_job_that_lies_is_driven_as_one_that_stands(plate_job, arm, tmp_path):
    pose = Similarity(upright(up_axis("z")), np.zeros(3), 1.0)
    job = read_simulation_job(turned_job(plate_job, tmp_path, pose))
    report = simulation_report(simulate(job, arm, placement=PLATE_PLACE))
    assert report["total"]["reached_share"] == 1.0
    assert report["placement"]["up"] == pytest.approx([0, 0, 1])
    assert not any("how its object lies" in line for line in report["warnings"])


def test_a_robot_that_reaches_nothing(plate_job, arm):
    place = Placement((4.0, 0.0, 0.3), np.pi, 0.0, (0.0,))
    with pytest.raises(
        RobotError, match=r"reaches none of the job's waypoints from its base at 4\.00"
    ):
        simulate(read_simulation_job(plate_job), arm, placement=place)
