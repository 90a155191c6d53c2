"""The metrics of the demonstration on the arm, against their bars."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

# Not by importing it: nrdf must be first, to choose what MuJoCo draws with.
if find_spec("mujoco") is None:
    pytest.skip("pip install 'nrdf[robot]'", allow_module_level=True)

from nrdf.errors import DataError
from nrdf_benchmark.arm import combine_reports, measure, simulate_demo


def report(achieved: float, reached: float = 0.97):
    path = {
        "position_error_m": 2e-5,
        "axis_error_rad": 3e-4,
        "coverage": {"planned": 0.99, "executed": 0.95, "achieved": achieved},
        "force": {"within": 2 * reached - 1, "seconds": 100 * reached},
    }
    other = {
        **path,
        "coverage": {"planned": 1.0, "executed": 1.0, "achieved": 1.0},
        "force": None,
    }
    return {
        "paths": [path, other],
        "total": {
            "waypoints": 200,
            "reached": 200 * reached,
            "reached_share": reached,
            "collisions": 0,
            "force_within": 0.97,
            "time_s": 200.0,
            "planned_time_s": 176.0,
        },
        "speed": {"ik_ms_per_waypoint": 3.0, "times_real_time": 100.0},
    }


def test_figures_are_the_worst_regions_and_say_whether_they_meet_the_bar():
    found = {f.name: f for f in measure({"one": report(0.94), "other": report(0.98, 0.9)})}
    assert found["waypoints reached, %"].met == (True, False)
    of_plan = found["coverage lost of the plan, worst region, %"]
    # Shares of what was planned: what a region has left out makes no loss smaller.
    lost = 100 * (1 - 0.94 / 0.99), 100 * (1 - 0.98 / 0.99)
    assert of_plan.values == pytest.approx(lost) and of_plan.met == (False, True)
    of_driven = found["coverage lost of what is executed, worst region, %"]
    assert of_driven.values == pytest.approx((100 * (1 - 0.94 / 0.95), 0.0))
    assert of_driven.met == (True, True)
    assert all(
        all(f.met) for name, f in found.items() if "lost" not in name and "reached" not in name
    )


def test_all_chairs_together_are_shares_of_all_their_waypoints_and_contact():
    reports = {"one": report(0.94, 0.9), "other": report(0.98, 0.6)}
    reports["one"]["total"].update(waypoints=100, reached=90)
    found = {f.name: f.values[0] for f in measure({"all": combine_reports(reports)})}
    assert found["waypoints reached, %"] == pytest.approx(100 * (90 + 120) / 300)
    within = (0.8 * 90 + 0.2 * 60) / (90 + 60)
    assert found["contact within ±20 % of the force, %"] == pytest.approx(100 * within)
    lost = 100 * (1 - 0.94 / 0.99)
    assert found["coverage lost of the plan, worst region, %"] == pytest.approx(lost)


def test_a_folder_that_is_no_demonstration(tmp_path):
    with pytest.raises(DataError, match=r"has no ladder-back, .*nrdf demo --out"):
        simulate_demo(tmp_path, lambda name: None)
