import numpy as np

from builders.regions_of_shapes import plate, plate_with_hole
from nrdf.geometry.polylines import step_lengths
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.planners.plane_slices import plan_plane_slices
from nrdf.toolpath.strategy import Strategy

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def process_segments(segments):
    return [segment for segment in segments if segment.kind == "process"]


def test_a_plate_is_one_zigzag_joined_on_the_surface():
    segments = plan_on_mesh(plate(), STRATEGY)
    assert [s.kind for s in segments] == ["approach", "process", "retract"]
    (work,) = process_segments(segments)
    assert step_lengths(work.positions).max() <= 2 * STRATEGY.spacing_m
    assert np.abs(work.positions[:, 2]).max() < 1e-9


def test_a_planner_can_be_given():
    work = process_segments(plan_on_mesh(plate_with_hole(), STRATEGY, plan_plane_slices))
    assert len(work) >= 1
    for line in work:
        assert step_lengths(line.positions).max() <= 2 * STRATEGY.spacing_m
