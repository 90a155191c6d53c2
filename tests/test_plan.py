"""Tool paths on surfaces with known shape: plates, with a hole, thin, turned, bent."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.process.coverage import measure
from nrdf.process.plan import TRAJECTORIES, Strategy, plan
from nrdf.process.surface import Surface

LENGTH, WIDTH, STEP = 0.4, 0.3, 0.008


def plate(hole: float = 0.0, seed: int = 0) -> np.ndarray:
    """Points (n, 3) of a plate at z = 0, off a grid, without a round hole in its middle."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(0, LENGTH, STEP), np.arange(0, WIDTH, STEP))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    points[:, :2] += rng.uniform(-0.3 * STEP, 0.3 * STEP, (len(points), 2))
    middle = points[:, :2] - [LENGTH / 2, WIDTH / 2]
    return points[np.linalg.norm(middle, axis=1) >= hole]


def upright(points: np.ndarray, up: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    return np.tile(up, (len(points), 1))


@pytest.fixture(scope="module")
def flat() -> Surface:
    points = plate()
    return Surface(points, upright(points))


def everything(surface: Surface) -> np.ndarray:
    return np.arange(len(surface.points))


def strategy(**changes) -> Strategy:
    values = {"direction": np.array([1.0, 0.0, 0.0]), "stepover_m": 0.03, **changes}
    return Strategy(**values)


def process(segments):
    return [segment for segment in segments if segment.kind == "process"]


def axes(segment) -> np.ndarray:
    return Rotation.from_quat(segment.quaternions_xyzw).as_matrix()


def test_a_raster_runs_along_its_direction_evenly_and_covers_the_plate(flat):
    chosen = strategy()
    segments = plan(flat, everything(flat), chosen)
    lines = process(segments)
    assert len(lines) == pytest.approx(WIDTH / chosen.stepover_m, abs=1.5)
    for line in lines:
        assert np.abs(line.positions[:, 2]).max() < 1e-4
        assert np.ptp(line.positions[:, 1]) < 0.005 < 0.3 < np.ptp(line.positions[:, 0])
        steps = np.linalg.norm(np.diff(line.positions, axis=0), axis=1)
        np.testing.assert_allclose(steps, chosen.spacing_m, rtol=0.1)
    heights = np.sort([line.positions[:, 1].mean() for line in lines])
    assert np.diff(heights).max() < 1.05 * chosen.stepover_m
    figures = measure(flat, everything(flat), chosen, segments)
    assert figures.coverage > 0.99
    assert figures.line_spacing_worst_m <= 1.15 * chosen.stepover_m
    assert figures.surface_distance_worst_m < 1e-4 and figures.axis_error_99_rad < 0.01
    length = sum(np.linalg.norm(np.diff(s.positions, axis=0), axis=1).sum() for s in lines)
    assert figures.process_length_m == pytest.approx(length)
    assert figures.cycle_time_s > length / chosen.feed_m_s


def test_the_tool_points_into_the_part_and_travels_along_x_of_its_frame(flat):
    for segment in process(plan(flat, everything(flat), strategy())):
        frame = axes(segment)
        np.testing.assert_allclose(np.linalg.norm(segment.quaternions_xyzw, axis=1), 1.0)
        np.testing.assert_allclose(np.linalg.det(frame), 1.0)
        np.testing.assert_allclose(frame[:, :, 2], [[0, 0, -1]] * len(frame), atol=0.02)
        travel = np.diff(segment.positions, axis=0)
        travel /= np.linalg.norm(travel, axis=1, keepdims=True)
        assert (np.einsum("na,na->n", frame[:-1, :, 0], travel) > 0.99).all()


def test_lines_follow_each_other_to_and_fro(flat):
    lines = process(plan(flat, everything(flat), strategy()))
    forward = [line.positions[-1, 0] > line.positions[0, 0] for line in lines]
    assert all(a != b for a, b in pairwise(forward))
    assert [line.line for line in lines] == list(range(len(lines)))


def test_every_line_is_approached_and_left_along_the_normal(flat):
    chosen = strategy(approach_distance_m=0.04, retract_distance_m=0.02, force_n=10.0)
    segments = plan(flat, everything(flat), chosen)
    assert [s.kind for s in segments[:3]] == ["approach", "process", "departure"]
    approach, work, departure = segments[:3]
    np.testing.assert_allclose(approach.positions[0] - work.positions[0], [0, 0, 0.04], atol=1e-3)
    np.testing.assert_allclose(
        departure.positions[-1] - work.positions[-1], [0, 0, 0.02], atol=1e-3
    )
    assert (approach.force_n, work.force_n, departure.force_n) == (None, 10.0, None)


def test_the_margin_stays_free(flat):
    margin = 0.04
    lines = process(plan(flat, everything(flat), strategy(edge_margin_m=margin)))
    places = np.concatenate([line.positions[:, :2] for line in lines])
    slack = STEP  # the border is as ragged as the points
    assert places.min() > margin - slack
    assert (places.max(axis=0) < np.array([LENGTH, WIDTH]) - margin + slack).all()


@pytest.mark.parametrize("trajectory", TRAJECTORIES)
def test_every_trajectory_covers_the_plate_and_does_not_cross_its_hole(trajectory):
    points = plate(hole=0.07)
    surface = Surface(points, upright(points))
    chosen = strategy(trajectory=trajectory)
    segments = plan(surface, everything(surface), chosen)
    lines = process(segments)
    for line in lines:
        away = np.linalg.norm(line.positions[:, :2] - [LENGTH / 2, WIDTH / 2], axis=1)
        assert away.min() > 0.07 - 1.5 * STEP
        turn = np.einsum("nab,nab->n", axes(line)[1:], axes(line)[:-1])
        # The trace of a turn by 90 degrees is 1: no flips from waypoint to waypoint.
        assert (turn > 0.9).all()
    assert measure(surface, everything(surface), chosen, segments).coverage > 0.98


def test_cross_hatching_is_two_rasters(flat):
    once = process(plan(flat, everything(flat), strategy()))
    twice = process(plan(flat, everything(flat), strategy(trajectory="cross-hatch")))
    across = [line for line in twice if np.ptp(line.positions[:, 0]) < 0.01]
    assert len(twice) - len(across) == len(once) and len(across) >= LENGTH / 0.03 - 2


def test_passes_drive_the_lines_again_and_back(flat):
    once = process(plan(flat, everything(flat), strategy()))
    twice = process(plan(flat, everything(flat), strategy(passes=2)))
    assert len(twice) == 2 * len(once)
    np.testing.assert_allclose(twice[len(once)].positions, once[-1].positions[::-1])


def test_a_thin_plate_is_worked_on_one_side_only():
    top, bottom = plate(), plate(seed=1) - [0, 0, 0.004]
    surface = Surface(
        np.concatenate([top, bottom]),
        np.concatenate([upright(top), upright(bottom, (0.0, 0.0, -1.0))]),
    )
    below = np.arange(len(top), len(top) + len(bottom))
    for line in process(plan(surface, below, strategy())):
        assert np.abs(line.positions[:, 2] + 0.004).max() < 1e-3
        assert (axes(line)[:, 2, 2] > 0.99).all()  # into the part: upwards


def test_a_tilted_tool_leans_by_what_was_asked(flat):
    lead = np.radians(15)
    lines = process(plan(flat, everything(flat), strategy(lead_rad=lead)))
    into = np.concatenate([axes(line)[:, :, 2] for line in lines])
    np.testing.assert_allclose(np.arccos(-into[:, 2]), lead, atol=0.02)
    sideways = process(plan(flat, everything(flat), strategy(tilt_rad=lead)))
    for line in sideways:
        leaning = axes(line)[:, :, 2]
        assert np.abs(leaning[:, 0]).max() < 0.02  # not along the travel


@pytest.mark.parametrize("trajectory", ["raster", "contour"])
def test_the_plan_moves_with_the_object(flat, trajectory):
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7])
    moved = Surface(turn.apply(flat.points) + np.array([3.0, -1.0, 0.5]), turn.apply(flat.normals))
    chosen = strategy(trajectory=trajectory)
    there = strategy(trajectory=trajectory, direction=turn.apply([1.0, 0.0, 0.0]))
    here = measure(flat, everything(flat), chosen, plan(flat, everything(flat), chosen))
    far = measure(moved, everything(moved), there, plan(moved, everything(moved), there))
    assert far.coverage == pytest.approx(here.coverage, abs=0.01)
    # Where the innermost contour ends hangs on how the plate is laid flat.
    within = 0.03 if trajectory == "raster" else 0.25
    assert far.process_length_m == pytest.approx(here.process_length_m, rel=within)


def test_lines_on_a_bent_plate_are_even_along_the_surface():
    points = plate()
    radius = 0.15
    angle = points[:, 1] / radius
    bent = np.stack([points[:, 0], radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    normals = np.stack([np.zeros(len(bent)), np.sin(angle), np.cos(angle)], axis=1)
    surface = Surface(bent, normals)
    chosen = strategy()
    segments = plan(surface, everything(surface), chosen)
    mean = [line.positions.mean(axis=0) for line in process(segments)]
    along = np.sort([radius * np.arctan2(place[1], place[2]) for place in mean])
    assert np.diff(along).max() < 1.15 * chosen.stepover_m
    figures = measure(surface, everything(surface), chosen, segments)
    assert figures.coverage > 0.99 and figures.surface_distance_99_m < 0.001
    assert figures.axis_error_99_rad < np.radians(5)


def test_half_a_raster_leaves_half_uncovered(flat):
    chosen = strategy()
    segments = plan(flat, everything(flat), chosen)
    half = measure(flat, everything(flat), chosen, segments[: len(segments) // 2])
    assert 0.4 < half.coverage < 0.65
    spread = measure(flat, everything(flat), chosen, segments[:3] + segments[9:12])
    assert spread.line_spacing_worst_m is None  # no line has a neighbour
    assert spread.coverage < half.coverage


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"edge_margin_m": 0.2}, r"edge_margin_m is 0\.2, which leaves nothing"),
        ({"stepover_m": 0.9}, r"stepover_m is 0\.9, wider than the region"),
        ({"direction": np.array([0.0, 0.0, 1.0])}, "stands on the region"),
    ],
)
def test_what_does_not_fit_the_region_is_explained(flat, changes, said):
    with pytest.raises(ProcessError, match=said):
        plan(flat, everything(flat), strategy(**changes))


def test_a_region_that_is_not_of_the_cloud_is_refused(flat):
    with pytest.raises(ProcessError, match="indices"):
        plan(flat, np.array([0, 10**6]), strategy())
    with pytest.raises(ProcessError, match="indices"):
        plan(flat, np.array([], int), strategy())
    with pytest.raises(ProcessError, match="without a process segment"):
        measure(flat, everything(flat), strategy(), [])
