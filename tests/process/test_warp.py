"""Waypoints warped from one box to another, by a correspondence that is known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import nrdf
from builders.scaled_box import SCALE, UP, line_on_top, scaled_reference
from builders.taught_box import SIZE, cloud
from nrdf.process.correspondence import Correspondence
from nrdf.process.warp import surface_under, warp_segments
from nrdf.surface.surface import Surface
from nrdf.toolpath.frames import tool_quaternions
from nrdf.toolpath.types import Segment


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


@pytest.fixture(scope="module")
def correspondence(model):
    reference = scaled_reference(model, cloud(), SCALE)
    return Correspondence(reference, model.encode(cloud(SIZE * SCALE, seed=1)))


def axes(line):
    """Columns x, y, z of the tools of a line, (3, n, 3)."""
    return np.moveaxis(Rotation.from_quat(line.quaternions_xyzw).as_matrix(), 2, 0)


def test_waypoints_go_where_the_surface_goes(correspondence):
    taught = line_on_top()
    (warped,), lost = warp_segments(correspondence, [taught], 0.025)
    assert lost == 0 and warped.line == 0
    np.testing.assert_array_equal(warped.source, np.arange(12))
    np.testing.assert_allclose(warped.positions, taught.positions * SCALE, atol=0.01)
    np.testing.assert_allclose(warped.positions[:, 1], SIZE[1] * SCALE[1] / 2, atol=2e-3)
    np.testing.assert_allclose(warped.normals @ UP, 1.0, atol=1e-3)


def test_the_height_over_the_surface_is_kept_not_scaled(correspondence):
    (warped,), _ = warp_segments(correspondence, [line_on_top(height=0.15)], 0.025)
    np.testing.assert_allclose(warped.positions[:, 1] - SIZE[1] * SCALE[1] / 2, 0.15, atol=2e-3)


@pytest.mark.parametrize(("lead", "tilt"), [(0.0, 0.0), (0.3, 0.0), (0.0, -0.4), (0.2, 0.3)])
def test_the_tool_keeps_its_angles_to_travel_and_normal(correspondence, lead, tilt):
    (warped,), _ = warp_segments(correspondence, [line_on_top(lead=lead, tilt=tilt)], 0.025)
    travel = SCALE * [0.2, 0.0, 0.5]
    travel = np.broadcast_to(travel / np.linalg.norm(travel), (12, 3))
    asked = tool_quaternions(travel, np.broadcast_to(UP, (12, 3)), lead, tilt)
    apart = Rotation.from_quat(warped.quaternions_xyzw) * Rotation.from_quat(asked).inv()
    assert np.degrees(apart.magnitude().max()) < 4.0


def test_a_waypoint_alone_keeps_its_angles_too(correspondence):
    single = line_on_top(tilt=0.3)
    single = Segment("process", 0, single.positions[:1], single.quaternions_xyzw[:1], 0.1)
    (warped,), _ = warp_segments(correspondence, [single], 0.025)
    x, _, z = axes(warped)
    np.testing.assert_allclose(-z @ UP, np.cos(0.3), atol=0.01)
    travel = SCALE * [0.2, 0.0, 0.5]
    assert x[0] @ travel / np.linalg.norm(travel) > 0.98


def test_a_tool_near_a_thin_edge_stays_on_its_side(model):
    thin = scaled_reference(model, cloud((0.5, 0.9, 0.02)), 1.0)
    same = Correspondence(thin, model.encode(cloud((0.5, 0.9, 0.02), seed=1)))
    places = np.stack([np.linspace(-0.2, 0.2, 9), np.zeros(9), np.full(9, 0.01)], axis=1)
    turns = tool_quaternions(np.tile([1.0, 0, 0], (9, 1)), np.tile([0, 0, 1.0], (9, 1)))
    (warped,), lost = warp_segments(same, [Segment("process", 0, places, turns, 0.1)], 0.025)
    assert lost == 0
    np.testing.assert_allclose(warped.positions, places, atol=0.01)
    assert (axes(warped)[2][:, 2] < -0.99).all()


def test_a_line_is_cut_where_the_target_has_no_surface(model):
    whole = cloud(seed=1)
    hole = (whole.normals[:, 1] > 0.5) & (np.abs(whole.points[:, 2]) < 0.12)
    correspondence = Correspondence(
        scaled_reference(model, cloud(), 1.0), model.encode(whole.select(~hole))
    )
    taught = line_on_top(count=40)
    warped, lost = warp_segments(correspondence, [taught], 0.025)
    assert len(warped) == 2 and [segment.line for segment in warped] == [0, 0]
    assert lost == 40 - sum(len(line.positions) for line in warped) > 4
    kept = np.concatenate([segment.source for segment in warped])
    assert np.abs(taught.positions[kept, 2]).min() > 0.06


def test_a_line_is_cut_where_the_surface_is_torn(model):
    """A panel warped to two slats: what would lie in the gap goes to their edges."""
    slats = cloud(count=12_000, seed=1)
    slats = slats.select(~((slats.normals[:, 1] > 0.5) & (np.abs(slats.points[:, 2]) < 0.03)))
    correspondence = Correspondence(scaled_reference(model, cloud(), 1.0), model.encode(slats))
    warped, lost = warp_segments(correspondence, [line_on_top(count=60)], 0.025)
    assert len(warped) == 2 and lost == 0
    for line in warped:
        assert np.linalg.norm(np.diff(line.positions, axis=0), axis=1).max() < 0.025


def test_nothing_is_warped_from_nothing(correspondence):
    assert warp_segments(correspondence, [], 0.025) == ((), 0)


def test_the_surface_next_to_a_square_corner_is_on_the_tools_side():
    box = cloud()
    surface = Surface(box.points, box.normals)
    x = np.linspace(-0.2, 0.2, 21)
    points = np.c_[x, np.full(21, SIZE[1] / 2), np.full(21, SIZE[2] / 2 - 1e-3)]
    upright = np.tile([0.0, 1.0, 1e-17], (21, 1))  # what rounding leaves of a right angle
    under, normals = surface_under(surface, points, upright)
    np.testing.assert_allclose(normals, np.tile([0.0, 1.0, 0.0], (21, 1)), atol=1e-6)
    np.testing.assert_allclose(under, points, atol=1e-6)
