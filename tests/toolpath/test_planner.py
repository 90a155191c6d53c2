"""Planning: what every tool path keeps to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from builders.surfaces import SPACING, board, dome, slats, tube, two_sided
from nrdf.errors import ProcessError
from nrdf.shapes.families import get_family
from nrdf.surface.surface import Surface
from nrdf.toolpath.metrics import measure_path
from nrdf.toolpath.planner import plan
from nrdf.toolpath.strategy import TRAJECTORIES, Strategy
from nrdf.toolpath.tool_segments import add_approach_retract
from nrdf.toolpath.types import Segment

STRATEGY = Strategy(stepover_m=0.025, spacing_m=0.01, tool_radius_m=0.025)
SURFACES = {"board": board, "slats": slats, "dome": dome, "half tube": lambda: tube(turn=np.pi)}


def planned(points, normals, **changes) -> tuple[Segment, ...]:
    surface = Surface(points, normals)
    return plan(surface, np.arange(len(surface.points)), replace(STRATEGY, **changes))


def processes(segments) -> list[Segment]:
    return [segment for segment in segments if segment.kind == "process"]


def frames(segment: Segment) -> np.ndarray:
    return Rotation.from_quat(segment.quaternions_xyzw).as_matrix()


@pytest.mark.parametrize("trajectory", TRAJECTORIES)
@pytest.mark.parametrize("shape", SURFACES)
def test_what_every_path_keeps_to(shape, trajectory):
    points, normals = SURFACES[shape]()
    surface = Surface(points, normals)
    region = np.arange(len(surface.points))
    strategy = replace(STRATEGY, trajectory=trajectory)
    segments = plan(surface, region, strategy)
    lines = processes(segments)
    assert [line.line for line in lines] == list(range(len(lines)))
    kinds = [segment.kind for segment in segments]
    assert kinds == ["approach", "process", "retract"] * len(lines)
    for line in lines:
        turns = frames(line)
        np.testing.assert_allclose(np.linalg.norm(line.quaternions_xyzw, axis=1), 1.0)
        outward = normals[surface.tree.query(line.positions)[1]]
        assert (np.einsum("na,na->n", turns[:, :, 2], outward) < -0.9).all()  # z into the part
        steps = np.diff(line.positions, axis=0)
        length = np.linalg.norm(steps, axis=1)
        ahead = np.einsum("na,na->n", turns[:-1, :, 0], steps)
        assert (ahead > 0.2 * length).all()  # x along the travel, smoothed round corners
        assert length.max() < 1.6 * STRATEGY.spacing_m
        turned = Rotation.from_matrix(turns[:-1].transpose(0, 2, 1) @ turns[1:]).magnitude()
        assert turned.max() < np.radians(60)
    found = measure_path(surface, region, strategy, segments)
    assert found.coverage > 0.99
    assert found.surface_distance_worst_m < 1e-3
    assert found.axis_error_99_rad < np.radians(1)


@pytest.mark.parametrize("shape", SURFACES)
def test_raster_lines_are_no_farther_apart_than_asked(shape):
    surface = Surface(*SURFACES[shape]())
    region = np.arange(len(surface.points))
    found = measure_path(surface, region, STRATEGY, plan(surface, region, STRATEGY))
    # A dome cannot be unrolled without stretch.
    assert found.line_spacing_worst_m < (1.2 if shape == "dome" else 1.1) * STRATEGY.stepover_m
    assert found.line_spacing_mean_m > 0.8 * STRATEGY.stepover_m


def test_every_region_of_a_chair_has_lines_that_stay_on_it():
    family = get_family("chair")
    sample = family.member(1_000_003).sample_surface(8192, np.random.default_rng(0))
    surface = Surface(0.9 * sample.points, sample.normals)
    named = family.region_of(sample.coordinates)
    off = []
    for name in ("seat", "seat-bottom", "back-front", "back-back", "leg-left-front"):
        for line in processes(plan(surface, np.flatnonzero(named == name), STRATEGY)):
            steps = np.linalg.norm(np.diff(line.positions, axis=0), axis=1)
            assert steps.max() < 2.0 * STRATEGY.spacing_m + surface.spacing
            off.append(surface.nearest(line.positions, -frames(line)[:, :, 2])[2])
    assert np.quantile(np.concatenate(off), 0.97) < 1e-3


def test_lines_go_along_the_direction_projected_to_the_surface():
    segments = planned(*board(), direction=np.array([1.0, 1.0, 5.0]))
    for line in processes(segments)[2:-2]:
        way = line.positions[-1] - line.positions[0]
        assert abs(way[0]) == pytest.approx(abs(way[1]), rel=0.05)


@pytest.mark.parametrize("margin", [0.02, 0.06])
@pytest.mark.parametrize("trajectory", TRAJECTORIES)
def test_waypoints_keep_the_margin(trajectory, margin):
    for line in processes(planned(*board(), trajectory=trajectory, edge_margin_m=margin)):
        places = line.positions[:, :2]
        inside = np.minimum(places, [0.4, 0.3] - places).min()
        assert inside > margin - SPACING  # the border is known to about half of that


def test_no_line_leads_across_a_gap():
    for trajectory in TRAJECTORIES:
        for line in processes(planned(*slats(), trajectory=trajectory)):
            x, y, _ = line.positions.T
            assert not ((np.abs(x - 0.2) < 0.02) & (np.abs(y - 0.15) < 0.08)).any()


def test_each_side_of_a_thin_board_is_worked_from_its_own_side():
    points, normals = two_sided(thickness=0.004)
    surface = Surface(points, normals)
    top = np.flatnonzero(normals[:, 2] > 0.0)
    (z,) = {tuple(p) for line in processes(plan(surface, top, STRATEGY))
            for p in np.round(np.c_[line.positions[:, 2], frames(line)[:, 2, 2]], 6)}  # fmt: skip
    assert z == (0.0, -1.0)
    both = processes(plan(surface, np.arange(len(surface.points)), STRATEGY))
    sides = [np.round(np.c_[line.positions[:, 2], frames(line)[:, 2, 2]], 6) for line in both]
    assert {tuple(np.unique(side, axis=0)[0]) for side in sides} == {(0.0, -1.0), (-0.004, 1.0)}


def test_a_rigid_motion_moves_the_path_and_changes_nothing():
    points, normals = tube(turn=2.0)
    turn, shift = Rotation.from_rotvec([0.4, -1.1, 0.7]), np.array([1.0, -2.0, 0.5])
    here = processes(planned(points, normals, direction=np.array([0.0, 0.0, 1.0]), lead_rad=0.2))
    there = processes(
        planned(
            turn.apply(points) + shift, turn.apply(normals),
            direction=turn.apply([0.0, 0.0, 1.0]), lead_rad=0.2,
        )
    )  # fmt: skip
    assert len(here) == len(there)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_allclose(turn.apply(one.positions) + shift, other.positions, atol=2e-3)
        moved = turn * Rotation.from_quat(one.quaternions_xyzw)
        error = (moved.inv() * Rotation.from_quat(other.quaternions_xyzw)).magnitude()
        assert error.max() < np.radians(2)


def test_the_tool_tilts_and_stands_off_along_its_axis():
    lead, tilt, standoff = 0.3, -0.2, 0.05
    segments = planned(*board(), lead_rad=lead, tilt_rad=tilt, standoff_m=standoff)
    for line in processes(segments):
        turns = frames(line)
        upright = turns @ Rotation.from_euler("YX", [-lead, tilt]).inv().as_matrix()
        np.testing.assert_allclose(upright[:, :, 2], [[0.0, 0.0, -1.0]] * len(turns), atol=1e-9)
        contacts = line.positions + standoff * turns[:, :, 2]
        np.testing.assert_allclose(contacts[:, 2], 0.0, atol=1e-6)


def test_approach_and_retract_follow_distance_angle_and_feed():
    segments = planned(
        *board(), approach_distance_m=0.03, approach_angle_rad=0.5, approach_feed_m_s=0.4,
        retract_distance_m=0.02, retract_angle_rad=np.pi / 2, retract_feed_m_s=0.3,
        force_n=12.0, dwell_s=0.7,
    )  # fmt: skip
    approach, work, retract = segments[3:6]
    assert (approach.kind, work.kind, retract.kind) == ("approach", "process", "retract")
    assert (approach.feed_m_s, work.feed_m_s, retract.feed_m_s) == (0.4, 0.1, 0.3)
    assert (approach.force_n, work.force_n, retract.force_n) == (None, 12.0, None)
    assert (approach.dwell_s, work.dwell_s, retract.dwell_s) == (0.0, 0.7, 0.0)
    ahead, up = frames(work)[0, :, 0], np.array([0.0, 0.0, 1.0])
    coming = approach.positions[0] - work.positions[0]
    np.testing.assert_allclose(coming, 0.03 * (np.cos(0.5) * up - np.sin(0.5) * ahead), atol=1e-4)
    np.testing.assert_array_equal(approach.positions[1], work.positions[0])
    going = retract.positions[1] - work.positions[-1]
    np.testing.assert_allclose(going, 0.02 * frames(work)[-1, :, 0], atol=1e-4)
    bare = planned(*board(), approach_distance_m=0.0, retract_distance_m=0.0)
    assert {segment.kind for segment in bare} == {"process"}


def test_passes_go_back_and_forth_and_the_tool_turns_round():
    one, two = (processes(planned(*board(), passes=n, lead_rad=0.3, tilt_rad=0.1)) for n in (1, 2))
    assert len(two) == 2 * len(one) and [line.line for line in two] == list(range(len(two)))
    back = two[len(one) :][::-1]
    for first, second in zip(one, back, strict=True):
        np.testing.assert_allclose(first.positions, second.positions[::-1])
        forth_frames, back_frames = frames(first), frames(second)[::-1]
        half = np.diag([-1.0, -1.0, 1.0])  # about the normal, which is z here
        np.testing.assert_allclose(half @ forth_frames, back_frames, atol=1e-9)


def test_given_lines_are_driven_as_they_are():
    positions = np.array([[0.0, 0.0, 0.0]])
    quaternions = Rotation.from_euler("x", np.pi).as_quat()[None]
    segments = add_approach_retract(
        [Segment("process", 0, positions, quaternions, 0.1)],
        [np.array([[0.0, 0.0, 1.0]])],
        STRATEGY,
    )
    assert [segment.kind for segment in segments] == ["approach", "process", "retract"]
    np.testing.assert_array_equal(segments[1].quaternions_xyzw, quaternions)
    np.testing.assert_allclose(segments[0].positions[0], [0.0, 0.0, 0.05])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"edge_margin_m": 0.2}, r"edge_margin_m is 0\.2, .* innermost place is 0\.1[45]\d* m"),
        ({"stepover_m": 0.5}, r"stepover_m is 0\.5, wider than the region, which measures 0\.[34]"),
        ({"direction": np.array([0.0, 0.0, 1.0])}, "stands on the region"),
    ],
)
@pytest.mark.parametrize("trajectory", ["raster", "cross-hatch"])
def test_what_does_not_fit_the_region_is_explained(trajectory, changes, message):
    with pytest.raises(ProcessError, match=message):
        planned(*board(), trajectory=trajectory, **changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"feed_m_s": 0.0}, "feed_m_s is 0.0; give a value above 0"),
        ({"stepover_m": np.nan}, "stepover_m is nan; give a value above 0"),
        ({"passes": 0}, "passes is 0; give a value above 0"),
        ({"standoff_m": -0.1}, "standoff_m is -0.1; give 0 or more"),
        ({"direction": np.zeros(3)}, "give 3 numbers, not all 0"),
        ({"trajectory": "zigzag"}, "no trajectory 'zigzag'; known: raster, plane-slices"),
    ],
)
def test_values_out_of_range_are_refused_by_name(changes, message):
    with pytest.raises(ProcessError, match=message):
        replace(STRATEGY, **changes)
