"""What the arm leaves of a plan."""

from __future__ import annotations

import numpy as np

from nrdf.process_model.cells import plate
from nrdf.process_model.feed_planner import FeedLimits
from nrdf.process_model.plan import plan_by_result
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.strategy import Strategy
from nrdf_benchmark.process_execution import execute_on_arm
from nrdf_benchmark.process_results import TARGET, gun, taught_strategy


def test_the_arm_leaves_about_what_was_planned_on_a_small_plate():
    mesh = plate(0.14, 0.06, 0.03)
    region = RegionMesh.from_faces(mesh, np.ones(len(mesh.faces), bool))
    profile = gun(0.05)
    taught = taught_strategy(Strategy(tool_radius_m=0.05, spacing_m=0.03), profile)
    lines = plan_on_mesh(region, taught)
    made = plan_by_result(region, lines, taught, profile, TARGET, FeedLimits())
    done = execute_on_arm(
        region, made, profile, TARGET, np.eye(3)[2], np.eye(3)[0], 0.05, poses=2_000, turns=2
    )
    assert done.reached > 0.95
    left, planned = done.metrics, made.metrics
    assert abs(left.mean_m / planned.mean_m - 1.0) < 0.05
    assert abs(left.variation - planned.variation) < 0.05
    assert abs(left.seconds / planned.seconds - 1.0) < 0.1
