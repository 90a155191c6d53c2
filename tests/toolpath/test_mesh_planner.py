"""Planners and modifiers together, as a strategy asks for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from builders.regions_of_shapes import plate, plate_with_hole, tube
from nrdf.geometry.mesh import Mesh
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.toolpath.mesh_planner import plan_on_mesh
from nrdf.toolpath.modifiers import MODIFIERS
from nrdf.toolpath.modifiers.split import turns
from nrdf.toolpath.planners.plane_slices import plan_plane_slices
from nrdf.toolpath.strategy import TRAJECTORIES, Strategy
from nrdf.toolpath.tool_segments import contact_points

STRATEGY = Strategy(stepover_m=0.02, spacing_m=0.01, tool_radius_m=0.012)


def process_segments(segments):
    return [segment for segment in segments if segment.kind == "process"]


def planned(region, **changes):
    return process_segments(plan_on_mesh(region, replace(STRATEGY, **changes)))


def test_a_plate_is_one_zigzag_joined_on_the_surface():
    segments = plan_on_mesh(plate(), STRATEGY)
    assert [s.kind for s in segments] == ["approach", "process", "retract"]
    (work,) = process_segments(segments)
    assert step_lengths(work.positions).max() <= 2 * STRATEGY.spacing_m
    assert np.abs(work.positions[:, 2]).max() < 1e-9


def test_joined_lines_cover_and_drive_all_that_lifted_ones_do():
    lifted, (joined,) = planned(plate(), line_order="snake"), planned(plate())
    assert len(lifted) == 10
    places = {tuple(np.round(p, 9)) for line in lifted for p in line.positions}
    assert places <= {tuple(np.round(p, 9)) for p in joined.positions}
    assert {joined.feed_m_s} == {line.feed_m_s for line in lifted}


@pytest.mark.parametrize("trajectory", TRAJECTORIES)
@pytest.mark.parametrize("shape", [plate_with_hole, tube])
def test_every_strategy_keeps_to_its_limits_with_lead_and_tilt(trajectory, shape):
    strategy = replace(STRATEGY, trajectory=trajectory, lead_rad=0.17, tilt_rad=0.09)
    region = shape()
    for line in process_segments(plan_on_mesh(region, strategy)):
        contacts = contact_points(line, strategy)
        steps = step_lengths(contacts)
        assert steps.max() <= 2 * STRATEGY.spacing_m
        allowed = np.maximum(steps, 1e-4) * STRATEGY.largest_turn_rad_m
        assert (turns(line.axes) <= allowed + 1e-9).all()
        assert region.mesh.nearest(contacts).distances.max() < 1e-6


def test_a_planner_can_be_given():
    work = process_segments(plan_on_mesh(plate_with_hole(), STRATEGY, plan_plane_slices))
    assert len(work) >= 1
    for line in work:
        assert step_lengths(line.positions).max() <= 2 * STRATEGY.spacing_m


def test_paint_runs_off_and_lifts_between_lines_or_turns_off_the_part():
    lifted = planned(plate(), line_order="snake", run_off_m=0.05, run_off_height_m=0.01)
    assert len(lifted) == 10
    for line in lifted:
        assert sorted(line.positions[[0, -1], 0]) == pytest.approx([-0.05, 0.45], abs=2e-3)
        assert line.positions[[0, -1], 2] == pytest.approx(0.01)
    (joined,) = planned(plate(), run_off_m=0.05)
    across = np.abs(np.diff(joined.positions[:, 1])) > 1e-6
    x = joined.positions[:-1, 0][across]
    assert ((x < -0.04) | (x > 0.44)).all()
    inside = (joined.positions[:, 0] > -1e-3) & (joined.positions[:, 0] < 0.401)
    assert (joined.on_surface == inside).all()
    assert planned(plate())[0].on_surface is None
    twice = planned(plate(), run_off_m=0.05, passes=2)
    assert twice[1].on_surface.tolist() == joined.on_surface[::-1].tolist()


def test_no_line_runs_off_into_a_wall():
    floor = trimesh.creation.box((0.4, 0.2, 0.02)).apply_translation((0, 0, -0.01))
    wall = trimesh.creation.box((0.02, 0.2, 0.3)).apply_translation((0.21, 0, 0.1))
    both = trimesh.util.concatenate([floor, wall])
    target = TargetMesh.from_mesh(Mesh(np.array(both.vertices), np.array(both.faces)))
    middles = target.vertices[target.faces].mean(axis=1)
    top = (target.face_normals[:, 2] > 0.9) & (np.abs(middles[:, 2]) < 1e-6)
    lines = planned(RegionMesh.from_faces(target, top), line_order="snake", run_off_m=0.05)
    for line in lines:
        ends = np.sort(line.positions[[0, -1], 0])
        assert ends[0] == pytest.approx(-0.25, abs=2e-3)
        assert ends[1] <= 0.2 + 1e-3


def test_one_way_lines_run_in_the_direction_and_start_in_the_corner():
    direction = np.array([-1.0, 0.0, 0.0])
    lines = planned(plate(), line_order="one-way", direction=direction, start="near-left")
    assert len(lines) == 10
    assert all(line.positions[-1, 0] < line.positions[0, 0] for line in lines)
    # Ahead is -x, so that left is -y, seen from above.
    assert (np.diff([line.positions[0, 1] for line in lines]) > 0).all()


def test_rings_begin_outside_or_inside():
    outside, inside = (
        planned(plate(), trajectory="spiral", start=start) for start in ("outside", "inside")
    )
    (one,), (other,) = outside, inside
    np.testing.assert_allclose(one.positions, other.positions[::-1], atol=1e-9)
    x, y, _ = one.positions[0]
    assert min(x, 0.4 - x, y, 0.2 - y) < 0.011


def test_lines_across_are_short():
    longest = max(total_length(s.positions) for s in planned(plate(), line_order="snake"))
    across = planned(plate(), line_order="snake", direction_mode="across")
    assert max(total_length(s.positions) for s in across) < 0.6 * longest


def test_a_second_pass_goes_back_over_the_first():
    once, twice = (plan_on_mesh(plate(), replace(STRATEGY, passes=n)) for n in (1, 2))
    (first,), (forth, back) = process_segments(once), process_segments(twice)
    np.testing.assert_allclose(forth.positions, first.positions)
    np.testing.assert_allclose(back.positions, first.positions[::-1])
    assert (forth.line, back.line) == (0, 1)


def test_what_leads_off_the_surface_does_so_by_as_much_as_asked():
    (line,) = planned(plate(), offset_m=0.002)
    assert line.positions[:, 2] == pytest.approx(0.002)
    strategy = {"lead_rad": 0.2, "edge_contact_m": 0.012}
    (line,) = planned(plate(), heading="fixed", **strategy)
    assert line.positions[:, 2] == pytest.approx(0.012 * np.sin(0.2))
    (line,) = planned(plate(), lead_in_radius_m=0.02)
    assert line.positions[:, 2] == pytest.approx(0.0)


def test_the_contact_keeps_the_feed_where_asked():
    given = {"standoff_m": 0.01, "trajectory": "plane-slices", "line_order": "snake"}
    across = np.array([0.0, 1.0, 0.0])
    for line in planned(tube(share=0.5), **given, direction=across, constant_speed=True):
        worked = step_lengths(contact_points(line, replace(STRATEGY, **given)))
        ratio = step_lengths(line.positions) / worked
        free = (ratio > 0.34) & (ratio < 2.9)  # the tool is driven within limits
        assert free.mean() > 0.8
        assert (line.speeds_m_s[1:] / ratio)[free] == pytest.approx(0.1)
        assert abs(line.feed_m_s - 0.1) > 0.01


def test_every_modifier_has_a_name():
    assert {"run-off", "join", "edge-contact", "approach-retract", "offset"} < set(MODIFIERS)


@pytest.mark.parametrize("trajectory", ["contour", "edge"])
def test_rings_are_driven_from_the_outside_in_or_from_the_inside_out(trajectory):
    region = plate_with_hole()
    made = {}
    for start in ("outside", "inside"):
        lines = planned(region, trajectory=trajectory, start=start, line_order="snake")
        # Distance from the nearest border: of the plate, or of its hole of 50 mm.
        places = [line.positions for line in lines]
        outer = [np.minimum(0.2 - np.abs(p[:, 0]), 0.15 - np.abs(p[:, 1])) for p in places]
        hole = [np.linalg.norm(p, axis=1) - 0.05 for p in places]
        depth = [np.minimum(o, h).mean() for o, h in zip(outer, hole, strict=True)]
        made[start] = depth if trajectory == "contour" else [o.mean() for o in outer]
    assert len(made["outside"]) >= 2
    assert (np.diff(made["outside"]) > -3e-3).all()
    assert (np.diff(made["inside"]) < 3e-3).all()


def test_the_nearest_next_is_driven_next():
    lines = planned(plate_with_hole(), line_order="nearest", direction=np.array([0.0, 1.0, 0.0]))
    ends = [line.positions[[0, -1]] for line in lines]
    for k, (_, stop) in enumerate(ends[:-1]):
        away = [np.linalg.norm(end - stop, axis=1).min() for end in ends[k + 1 :]]
        assert np.linalg.norm(ends[k + 1][0] - stop) == pytest.approx(min(away))


def test_fewer_waypoints_stay_within_the_chord_error_and_the_turn():
    given = {"direction_mode": "across", "spacing_m": 0.001, "chord_error_m": 1e-4}
    dense, thin = planned(tube(), **given), planned(tube(), **given, resample_step_m=0.08)
    assert len(thin) == len(dense)
    assert sum(len(s.positions) for s in thin) < 0.7 * sum(len(s.positions) for s in dense)
    for one, other in zip(dense, thin, strict=True):
        assert step_lengths(other.positions).max() <= 0.08
        assert turns(other.axes).max() <= np.radians(5.0) + 1e-9
        for place in one.positions:
            start, ahead = other.positions[:-1], np.diff(other.positions, axis=0)
            share = ((place - start) * ahead).sum(axis=1) / (ahead**2).sum(axis=1)
            on = start + np.clip(share, 0.0, 1.0)[:, None] * ahead
            assert np.linalg.norm(on - place, axis=1).min() <= 1e-4 + 1e-9
