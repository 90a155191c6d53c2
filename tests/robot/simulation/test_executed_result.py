"""The depth that a simulated arm left on a plate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.process.process import Process
from nrdf.robot.planning.timing import STEP_S
from nrdf.robot.report.content import executed_heat_maps, simulation_report
from nrdf.robot.report.html_report import write_html_report
from nrdf.robot.simulation.executed_result import executed_motion, executed_result

SAND = Process.model_validate({
    "kind": "sand", "stepover_mm": 30, "feed_mm_s": 100, "force_n": 10, "spindle_rpm": 9000,
    "removal_um": "20 ± 8",
    "tool": {"radius_mm": 25, "pad": {"preston_per_pa": 5e-9, "orbit_mm": 2.5}},
})  # fmt: skip


@pytest.fixture(scope="module")
def left(plate):
    path = plate.paths[0]
    region = plate.simulation_job.surfaces.regions["top"]
    return executed_result(SAND, region, path.path, path.cell, path.logs, plate.shift_m)


def test_the_motion_is_all_that_the_tool_did_along_its_lines(plate):
    path = plate.paths[0]
    motion = executed_motion(path.cell, path.logs, np.array([0.0, 0.1, 0.0]))
    working = [log for log in path.logs if log.action.kind == "process"]
    assert motion.samples.weights.sum() == pytest.approx(
        STEP_S * sum(len(log.tip) for log in working)
    )
    assert np.median(motion.samples.places[:, 1]) == pytest.approx(0.32, abs=0.005)
    assert np.median(motion.speeds_m_s) == pytest.approx(0.1, rel=0.1)
    assert np.median(motion.force_n) == pytest.approx(10.0, rel=0.1)
    product = np.einsum("na,na->n", motion.samples.axes, motion.samples.along)
    assert np.abs(product).max() < 1e-9


def test_depth_is_of_the_force_and_the_time_that_were_there(plate, left):
    """As much as was planned along the lines; more where the pad waited for its force."""
    assert left.metrics.mean_m == pytest.approx(left.planned.mean_m, rel=0.35)
    assert left.metrics.mean_m > left.planned.mean_m
    assert left.metrics.seconds > left.planned.seconds


def test_a_process_without_a_target_leaves_nothing_to_measure(plate):
    path = plate.paths[0]
    plain = SAND.model_copy(update={"removal_um": None})
    region = plate.simulation_job.surfaces.regions["top"]
    none = executed_result(plain, region, path.path, path.cell, path.logs, plate.shift_m)
    assert none is None and path.result is None


def test_the_report_shows_it_beside_the_plan(plate, left, tmp_path):
    result = replace(plate, paths=(replace(plate.paths[0], result=left),))
    report = simulation_report(result)
    (path,) = report["paths"]
    assert path["result"]["executed"]["within"] == left.metrics.within
    assert any("of the region has 20 ± 8 µm (planned: " in line for line in report["warnings"])
    (drawn,) = executed_heat_maps(result)
    assert sum(drawn.shares) == pytest.approx(1.0)
    write_html_report(tmp_path, {"title": "plate", **report}, [drawn])
    page = (tmp_path / "report.html").read_text()
    assert "What the arm really left" in page and "within it, executed · planned" in page
    assert executed_heat_maps(plate) == [None]
