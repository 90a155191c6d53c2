"""Metrics of paths for which they are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.regions_of_shapes import plate, sheet
from nrdf.errors import ProcessError
from nrdf.surface.given_surface import MeshSurface
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.tool_segments import add_approach_retract
from nrdf.toolpath.types import Segment

STRATEGY = Strategy(stepover_m=0.04, spacing_m=0.01, tool_radius_m=0.025, feed_m_s=0.1)
BOARD = plate(0.4, 0.3)
DOWN = Rotation.from_euler("x", np.pi)


def process_segment(positions, turn):
    held = np.tile(turn.as_quat(), (len(positions), 1))
    return Segment("process", 0, positions, held, 0.1)


def lines(*levels: float, x=(0.0, 0.4), z: float = 0.0, turn: Rotation = DOWN, strategy=STRATEGY):
    """Straight lines along x at heights y, as driven."""
    along = np.linspace(*x, 41)
    drawn = [process_segment(np.c_[along, np.full(41, y), np.full(41, z)], turn) for y in levels]
    return add_approach_retract(drawn, [np.tile([0.0, 0.0, 1.0], (41, 1))] * len(levels), strategy)


def test_coverage_is_the_share_of_the_area_within_the_tool_radius():
    found = measure_path(BOARD, STRATEGY, lines(0.1, 0.2))
    assert found.coverage == pytest.approx(0.1 / 0.3, abs=0.02)
    assert found.overlap == 0.0


def test_overlap_is_the_share_that_is_passed_over_twice():
    found = measure_path(BOARD, STRATEGY, lines(0.1, 0.13))
    assert found.coverage == pytest.approx(0.08 / 0.3, abs=0.02)
    assert found.overlap == pytest.approx(0.02 / 0.08, abs=0.05)


def test_the_margin_need_not_be_covered_and_is_said_to_be_left_out():
    narrow = lines(0.125, 0.175, x=(0.09, 0.31))
    all_of_it = measure_path(BOARD, STRATEGY, narrow)
    assert all_of_it.coverage < 0.3 and all_of_it.unreached > 0.7
    assert all_of_it.left_out == {"no_clearance": 0.0, "edge_margin": 0.0}
    inner = measure_path(BOARD, replace(STRATEGY, edge_margin_m=0.1), narrow)
    assert inner.coverage == all_of_it.coverage  # of the whole region, whatever is left out
    assert inner.unreached < 0.01
    assert inner.left_out["edge_margin"] == pytest.approx(1 - 0.23, abs=0.03)


@pytest.mark.parametrize("margin", [0.0, 0.03])
def test_worked_left_out_and_unreached_add_up_to_the_whole_region(margin):
    found = measure_path(BOARD, replace(STRATEGY, edge_margin_m=margin), lines(0.1, 0.13))
    assert found.coverage + sum(found.left_out.values()) + found.unreached == pytest.approx(1.0)
    assert (found.left_out["edge_margin"] > 0.2) == (margin > 0)


def test_a_step_through_the_air_is_a_figure():
    whole = lines(0.1)
    (work,) = (s for s in whole if s.kind == "process")
    assert measure_path(BOARD, STRATEGY, whole).step_worst_m == pytest.approx(0.01)
    kept = np.r_[0:11, 38:41]
    jump = replace(
        work, positions=work.positions[kept], quaternions_xyzw=work.quaternions_xyzw[kept]
    )
    assert measure_path(BOARD, STRATEGY, [jump]).step_worst_m == pytest.approx(0.28)


def test_the_largest_turn_between_waypoints_in_all_and_by_length():
    (work,) = (s for s in lines(0.1) if s.kind == "process")
    turned = np.tile(DOWN.as_quat(), (41, 1))
    turned[20:] = (Rotation.from_euler("y", 0.6) * DOWN).as_quat()
    turned[30:] = -turned[30:]  # the other sign is the same orientation
    found = measure_path(BOARD, STRATEGY, [replace(work, quaternions_xyzw=turned)])
    assert found.turn_worst_rad == pytest.approx(0.6)
    assert found.bend_worst_rad_m == pytest.approx(0.6 / 0.01)
    # A spin about the tool's own axis is none.
    spun = (DOWN * Rotation.from_euler("z", np.linspace(0, 3, 41)[:, None])).as_quat()
    found = measure_path(BOARD, STRATEGY, [replace(work, quaternions_xyzw=spun)])
    assert found.turn_worst_rad == pytest.approx(0.0, abs=1e-6)


def test_a_step_counts_where_the_tool_is_as_well_as_on_the_surface():
    """0.1 m above the surface a tool that turns moves farther than the place that it faces."""
    high = replace(STRATEGY, standoff_m=0.1)
    (work,) = (s for s in lines(0.1, strategy=high) if s.kind == "process")
    turns = Rotation.from_euler("y", np.where(np.arange(41) < 20, 0.0, 0.5)[:, None]) * DOWN
    places = work.positions - 0.1 * turns.as_matrix()[:, :, 2]
    found = measure_path(
        BOARD, high, [replace(work, positions=places, quaternions_xyzw=turns.as_quat())]
    )
    assert found.step_worst_m == pytest.approx(float(np.linalg.norm(places[20] - places[19])))
    assert found.step_worst_m > 0.05


def test_the_object_as_given_shows_what_the_plan_cannot_see():
    """The plan's surface is 4 mm above the mesh: by itself it is without fault."""
    mesh = MeshSurface(
        np.array([[-1, -1, -4e-3], [2, -1, -4e-3], [0, 3, -4e-3]], float), [[0, 1, 2]]
    )
    found = measure_path(BOARD, STRATEGY, lines(0.1, 0.2, x=(0.05, 0.35)), mesh)
    assert found.surface_distance_worst_m < 1e-6
    assert found.true_distance_95_m == pytest.approx(4e-3)
    assert found.true_distance_worst_m == pytest.approx(4e-3)
    assert found.compared_with == "the mesh as given (1 triangles)"
    alone = measure_path(BOARD, STRATEGY, lines(0.1, 0.2, x=(0.05, 0.35)))
    assert alone.compared_with is None and alone.true_distance_worst_m is None


def test_the_surface_between_waypoints_is_compared_as_well():
    """Both waypoints are on the valley's rims, the straight way between them is above it."""
    rims = np.array(
        [[0, -1, 0], [0, 1, 0], [0.2, -1, -0.1], [0.2, 1, -0.1], [0.4, -1, 0], [0.4, 1, 0]]
    )
    valley = MeshSurface(rims.astype(float), [[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]])
    (work,) = (s for s in lines(0.1) if s.kind == "process")
    ends = replace(
        work, positions=work.positions[[0, -1]], quaternions_xyzw=work.quaternions_xyzw[:2]
    )
    found = measure_path(BOARD, STRATEGY, [ends], valley)
    assert found.true_distance_worst_m == pytest.approx(0.1 * np.cos(np.arctan(0.5)), rel=0.05)


def test_the_other_side_of_a_thin_board_is_not_reached():
    top = BOARD.mesh
    vertices = np.concatenate([top.vertices, top.vertices - [0.0, 0.0, 0.003]])
    bottom = top.faces[:, ::-1] + len(top.vertices)
    both = TargetMesh(vertices, np.concatenate([top.faces, bottom]))
    region = RegionMesh.from_faces(both, np.ones(len(both.faces), bool))
    found = measure_path(region, STRATEGY, lines(0.025, 0.075, 0.125))
    assert found.coverage == pytest.approx(0.25, abs=0.02)


def test_spacing_is_the_distance_to_the_lines_beside():
    found = measure_path(BOARD, STRATEGY, lines(0.1, 0.13, 0.18))
    assert found.line_spacing_worst_m == pytest.approx(0.05, abs=1e-4)
    assert found.line_spacing_mean_m == pytest.approx(0.04, abs=1e-3)
    alone = measure_path(BOARD, STRATEGY, lines(0.1))
    assert alone.line_spacing_mean_m is None and alone.line_spacing_worst_m is None


def test_spacing_is_measured_along_the_surface():
    half = sheet(
        lambda u, v: np.stack(
            [0.06 * np.cos(np.pi * (u - 0.5)), 0.06 * np.sin(np.pi * (u - 0.5)), 0.3 * v], axis=1
        ),
        1, 48,
    )  # fmt: skip
    along = np.linspace(0.02, 0.28, 27)
    drawn, normals = [], []
    for angle in (-0.5, 0.5):
        outward = np.array([np.cos(angle), np.sin(angle), 0.0])
        turn = Rotation.from_matrix(
            np.stack([[0, 0, 1], np.cross(-outward, [0, 0, 1]), -outward], 1)
        )
        drawn.append(process_segment(0.06 * outward + np.c_[np.zeros((27, 2)), along], turn))
        normals.append(np.tile(outward, (27, 1)))
    found = measure_path(half, STRATEGY, add_approach_retract(drawn, normals, STRATEGY))
    assert found.line_spacing_mean_m == pytest.approx(0.06, rel=0.02)  # the chord is 0.0575


def test_a_line_beyond_a_gap_is_no_neighbour():
    rows = np.array([0.0, 0.13, 0.17, 0.3])
    corners = np.array([[x, y, 0.0] for y in rows for x in (0.0, 0.02, 0.38, 0.4)])
    cells = [(r, c) for r in range(3) for c in range(3) if (r, c) != (1, 1)]
    faces = [
        face
        for r, c in cells
        for a in [4 * r + c]
        for face in ((a, a + 1, a + 5), (a, a + 5, a + 4))
    ]
    mesh = TargetMesh(corners, np.array(faces))
    frame = RegionMesh.from_faces(mesh, np.ones(len(faces), bool))
    found = measure_path(frame, STRATEGY, lines(0.11, 0.19, x=(0.05, 0.35)))
    assert found.line_spacing_worst_m is None


def test_height_over_the_surface_counts_but_the_stand_off_does_not():
    off = measure_path(BOARD, STRATEGY, lines(0.1, 0.2, z=0.002, x=(0.05, 0.35)))
    assert off.surface_distance_worst_m == pytest.approx(0.002, abs=1e-6)
    assert off.surface_distance_99_m == pytest.approx(0.002, abs=1e-6)
    held = replace(STRATEGY, standoff_m=0.002)
    right = measure_path(BOARD, held, lines(0.1, 0.2, z=0.002, x=(0.05, 0.35)))
    assert right.surface_distance_worst_m < 1e-6


def test_the_axis_is_compared_with_the_one_asked_for():
    tilted = DOWN * Rotation.from_euler("Y", -0.25)
    found = measure_path(BOARD, STRATEGY, lines(0.1, 0.2, turn=tilted))
    assert found.axis_error_99_rad == pytest.approx(0.25, abs=1e-6)
    asked = replace(STRATEGY, lead_rad=0.25)
    assert measure_path(BOARD, asked, lines(0.1, 0.2, turn=tilted)).axis_error_99_rad < 1e-6


def test_lengths_and_times_add_up():
    strategy = replace(
        STRATEGY, dwell_s=0.5, approach_distance_m=0.05, retract_distance_m=0.02,
        approach_feed_m_s=0.2, retract_feed_m_s=0.4,
    )  # fmt: skip
    found = measure_path(BOARD, strategy, lines(0.1, 0.2, strategy=strategy))
    assert found.process_length_m == pytest.approx(0.8)
    between = np.hypot(np.hypot(0.4, 0.1), 0.03)  # from one line's retract to the next's approach
    assert found.path_length_m == pytest.approx(0.8 + 2 * 0.07 + between)
    wanted = 0.8 / 0.1 + 2 * 0.5 + 2 * (0.05 / 0.2 + 0.02 / 0.4) + between / 0.2
    assert found.cycle_time_s == pytest.approx(wanted)


def test_passes_are_driven_but_overlap_is_that_of_one():
    twice = replace(STRATEGY, passes=2)
    one = measure_path(BOARD, STRATEGY, lines(0.1, 0.2))
    two = measure_path(BOARD, twice, lines(0.1, 0.2, strategy=twice))
    assert two.process_length_m == pytest.approx(2 * one.process_length_m)
    assert (two.coverage, two.overlap) == (one.coverage, one.overlap)


def test_a_path_that_only_moves_freely_is_refused():
    free = [segment for segment in lines(0.1) if segment.kind != "process"]
    with pytest.raises(ProcessError, match="without a process segment"):
        measure_path(BOARD, STRATEGY, free)


def test_what_runs_off_within_a_stroke_is_no_work_beside_the_surface():
    strategy = replace(STRATEGY, run_off_m=0.06)
    given = MeshSurface(BOARD.mesh.vertices, BOARD.mesh.faces)
    segments = plan_on_mesh(BOARD, strategy)
    (work,) = [s for s in segments if s.kind == "process"]
    found = measure_path(BOARD, strategy, segments, given)
    assert found.true_distance_worst_m < 1e-9 and found.surface_distance_worst_m < 1e-9
    silent = [replace(s, on_surface=None) if s is work else s for s in segments]
    assert measure_path(BOARD, strategy, silent, given).true_distance_worst_m > 0.05
