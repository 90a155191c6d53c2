from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nrdf.robot.planning.reachability import Reachability
from nrdf.robot.simulation.metrics import VERDICTS, measure_path


def measured(plate, **changes):
    """The plate's metrics anew, with another strategy or program."""
    path, job = plate.paths[0], plate.simulation_job
    whole = [np.ones(9, bool)] * 3
    given = {"strategy": path.strategy, "program": path.program, **changes}
    return measure_path(
        job.surfaces.regions["top"], path.path,
        given["strategy"], path.cell, given["program"], whole, [Reachability(*whole)] * 3,
        path.logs,
    )  # fmt: skip


def test_verdicts_and_times_add_up(plate):
    metrics, program = plate.paths[0].metrics, plate.paths[0].program
    assert sum(metrics.count(verdict) for verdict in VERDICTS) == metrics.waypoints == 27
    assert metrics.count("reached") == metrics.reached
    assert metrics.joint_paths == len(program.joint_paths)
    assert set(metrics.seconds) == {action.kind for action in program.actions}
    assert metrics.cycle_time_s == pytest.approx(sum(metrics.seconds.values()))
    assert metrics.position_error_m < 1e-4 and np.degrees(metrics.axis_error_rad) < 0.1
    assert metrics.tilted == 0 and metrics.force_commanded_n == 10.0


def test_a_joint_path_that_is_not_in_the_program_counts_as_a_collision(plate):
    program = plate.paths[0].program
    left_out = len(program.joint_paths[0].joints)
    metrics = measured(plate, program=replace(program, joint_paths=program.joint_paths[1:]))
    assert metrics.count("collision") == left_out and metrics.reached == 27 - left_out
    assert metrics.executed.worked < metrics.planned.worked


def test_the_strategy_says_what_was_to_be_worked(plate):
    path = plate.paths[0]
    metrics = measured(plate, strategy=replace(path.strategy, edge_margin_m=0.05))
    assert metrics.achieved.left_out["edge_margin"] > 0.1
    assert path.metrics.achieved.left_out["edge_margin"] == 0.0
