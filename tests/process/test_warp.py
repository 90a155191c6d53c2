"""Waypoints warped from one box to another, by a C that is told where every place goes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import nrdf
from builders.taught_box import SIZE, cloud, faces
from nrdf.process.correspondence import Correspondence, ReferenceSurface
from nrdf.process.taught_paths import surface_under
from nrdf.process.warp import warp_segments
from nrdf.regions.mapping import MappedPoints
from nrdf.surface.surface import Surface
from nrdf.toolpath.frames import tool_quaternions
from nrdf.toolpath.types import Segment

SCALE = np.array([1.3, 0.8, 1.1])
UP = np.array([0.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def model(untrained):
    return nrdf.load_model(untrained)


def taught_on(model, reference, scale):
    """A reference whose places go to `scale` (3,) times where they are."""
    taught = model.set_reference(reference)

    def places(points, normals, target):
        there = target.canonical(points * scale)
        count = len(points)
        return MappedPoints(there, normals, np.ones(count), np.zeros(count), np.zeros((count, 3)))

    taught.map_surface_points = places
    taught.map_points = lambda at, target: places(
        reference.points[at], reference.normals[at], target
    )
    surface = ReferenceSurface(taught)
    surface.mirrored = taught  # to whom all the same is told of mirror images
    return surface


@pytest.fixture(scope="module")
def correspondence(model):
    reference = taught_on(model, cloud(), SCALE)
    return Correspondence(reference, model.encode(cloud(SIZE * SCALE, seed=1)))


def line_on_top(height=0.0, lead=0.0, tilt=0.0, count=12):
    """A line on the top face, from one corner's side to the other's."""
    along = np.linspace(-0.5, 0.5, count)[:, None]
    places = along * [0.2, 0.0, 0.5] + [0.0, SIZE[1] / 2, 0.0]
    travel = np.broadcast_to([0.2, 0.0, 0.5] / np.hypot(0.2, 0.5), places.shape)
    turns = tool_quaternions(travel, np.broadcast_to(UP, places.shape), lead, tilt)
    return Segment("process", 0, places + height * UP, turns, 0.1)


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
    thin = taught_on(model, cloud((0.5, 0.9, 0.02)), 1.0)
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
        taught_on(model, cloud(), 1.0), model.encode(whole.select(~hole))
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
    correspondence = Correspondence(taught_on(model, cloud(), 1.0), model.encode(slats))
    warped, lost = warp_segments(correspondence, [line_on_top(count=60)], 0.025)
    assert len(warped) == 2 and lost == 0
    for line in warped:
        assert np.linalg.norm(np.diff(line.positions, axis=0), axis=1).max() < 0.025


def test_nothing_is_carried_from_nothing(correspondence):
    assert warp_segments(correspondence, [], 0.025) == ((), 0)


def test_a_direction_follows_the_surface(correspondence):
    for name, given in (("top", [1.0, 0.0, 1.0]), ("front", [0.0, 2.0, 1.0])):
        there = correspondence.map_direction(faces(cloud())[name], np.array(given))
        expected = SCALE * given
        assert there @ expected / np.linalg.norm(expected) > np.cos(np.radians(3))
        assert np.linalg.norm(there) == pytest.approx(1.0)
    spot = faces(cloud())["top"][:1]
    np.testing.assert_allclose(correspondence.map_direction(spot, 3 * UP), UP)


def test_a_mirror_image_is_asked_too_and_brought_back(model):
    """An untrained C puts a shape onto itself; so does its mirror image's."""
    reference = ReferenceSurface(model.set_reference(cloud()))
    correspondence = Correspondence(reference, model.encode(cloud(seed=1)))
    points, normals = cloud().points[:50], cloud().normals[:50]
    mapped = correspondence._mapped(points, normals)
    np.testing.assert_allclose(correspondence.target.original(mapped.points), points, atol=0.01)
    np.testing.assert_allclose(mapped.normals, normals, atol=0.05)


def test_a_foot_next_to_a_square_corner_is_on_the_tools_side():
    box = cloud()
    surface = Surface(box.points, box.normals)
    x = np.linspace(-0.2, 0.2, 21)
    places = np.c_[x, np.full(21, SIZE[1] / 2), np.full(21, SIZE[2] / 2 - 1e-3)]
    upright = np.tile([0.0, 1.0, 1e-17], (21, 1))  # what rounding leaves of a right angle
    feet, normals = surface_under(surface, places, upright)
    np.testing.assert_allclose(normals, np.tile([0.0, 1.0, 0.0], (21, 1)), atol=1e-6)
    np.testing.assert_allclose(feet, places, atol=1e-6)
