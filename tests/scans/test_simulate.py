"""Simulated cameras see what faces them and nothing behind it, where the truth says it is."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from builders.scenes import pose, scan_of, triangles
from nrdf.errors import DataError
from nrdf.geometry.canonical import rotation_about_up
from nrdf.geometry.similarity import Similarity, up_axis, upright
from nrdf.scans.simulate import ScanSettings, simulate_scan
from nrdf.shapes.families import get_family
from nrdf.shapes.families.tessellation import tessellate

BALL = trimesh.creation.icosphere(4, 0.5)
POSE = Similarity(upright(up_axis("z")) @ rotation_about_up(0.7), np.array([5.0, -3.0, 1.0]), 100.0)
SMALL = ScanSettings(pixels=60)
CHAIR = 1_000_003


def look(mesh=BALL, settings=SMALL, seed=0, pose=None):
    return simulate_scan(mesh.vertices, mesh.faces, settings, np.random.default_rng(seed), pose)


def test_points_lie_on_the_surface_and_face_their_sensor():
    seen = look(settings=ScanSettings(views=2, pixels=60))
    radius = np.linalg.norm(seen.cloud.points, axis=1)
    assert np.abs(radius - 0.5).max() < 0.002 and len(radius) > 3000
    toward = seen.cloud.sensors[seen.view] - seen.cloud.points
    assert ((toward * seen.normals).sum(1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(seen.normals, axis=1), 1)
    assert set(seen.view) == {0, 1} and (seen.face >= 0).all()
    corners = BALL.triangles[seen.face]
    weights = np.stack([1 - seen.second - seen.third, seen.second, seen.third], 1)
    np.testing.assert_allclose((corners * weights[..., None]).sum(1), seen.cloud.points, atol=1e-5)


def test_cameras_keep_their_distance_and_go_around():
    seen = look(settings=ScanSettings(views=4, pixels=20, distance=3.0))
    sensors = seen.cloud.sensors
    np.testing.assert_allclose(np.linalg.norm(sensors, axis=1), 3.0, atol=0.01)
    elevation = np.degrees(np.arcsin(sensors[:, 1] / 3))
    assert (elevation > 9).all() and (elevation < 41).all()
    azimuth = np.sort(np.degrees(np.arctan2(sensors[:, 2], sensors[:, 0])) % 360)
    gaps = np.diff(np.append(azimuth, azimuth[0] + 360))
    assert (gaps > 55).all() and (gaps < 125).all()


def test_the_pose_moves_what_is_seen_and_leads_back():
    here, there = look(), look(pose=POSE)
    np.testing.assert_allclose(POSE.to_canonical(there.cloud.points), here.cloud.points, atol=1e-9)
    np.testing.assert_allclose(
        POSE.to_canonical(there.cloud.sensors), here.cloud.sensors, atol=1e-9
    )
    np.testing.assert_allclose(there.normals @ POSE.rotation, here.normals, atol=1e-9)
    scaled = np.c_[100 * here.cloud.points, np.ones(len(here.cloud))]
    np.testing.assert_allclose(
        (scaled @ POSE.T_scan_canonical.T)[:, :3], there.cloud.points, atol=1e-9
    )
    twice = POSE.then(POSE)
    np.testing.assert_allclose(
        twice.to_scan(here.cloud.points), POSE.to_scan(there.cloud.points), atol=1e-6
    )


def test_noise_lies_along_the_ray_and_grows_with_depth_squared():
    bar = trimesh.creation.box((1.0, 0.3, 0.3))
    settings = ScanSettings(views=1, pixels=200, noise=0.01, distance=0.9, grazing=0.0)
    clean = look(bar, ScanSettings(**{**vars(settings), "noise": 0.0}), seed=4)
    noisy = look(bar, settings, seed=4)
    moved = noisy.cloud.points - clean.cloud.points
    rays = clean.cloud.points - clean.cloud.sensors
    length = np.linalg.norm(rays, axis=1)
    along = (moved * rays).sum(1) / length
    assert np.abs(moved - along[:, None] * rays / length[:, None]).max() < 1e-9
    axis = -clean.cloud.sensors[0] / 0.9
    cosine = rays @ axis / length
    depth = length * cosine
    normal = along * cosine / (0.01 * (depth / 0.9) ** 2)
    middle = np.median(depth)
    assert depth.max() > 1.5 * depth.min()
    for part in (depth < middle, depth > middle):
        assert normal[part].std() == pytest.approx(1, abs=0.05)


def test_quantised_depth_comes_in_steps():
    wall = trimesh.creation.box((0.02, 1.0, 1.0))
    settings = ScanSettings(views=1, pixels=80, quantisation=0.05, lowest=0.0, highest=1e-6)
    seen = look(wall, settings, seed=2)
    toward = seen.cloud.sensors[0] / np.linalg.norm(seen.cloud.sensors[0])
    depth = (seen.cloud.sensors[0] - seen.cloud.points) @ toward
    exact = look(wall, ScanSettings(**{**vars(settings), "quantisation": 0.0}), seed=2)
    true = (exact.cloud.sensors[0] - exact.cloud.points) @ toward
    step = 0.05 * (true / 2) ** 2
    assert np.abs(depth / step - np.round(depth / step)).max() < 1e-6
    assert np.abs(depth - true).max() <= 0.51 * step.max()


def test_grazing_rays_drop_out_gradually():
    settings = ScanSettings(views=1, pixels=200, grazing=np.radians(30))
    seen, everything = look(settings=settings), look(settings=ScanSettings(**{
        **vars(settings), "grazing": 0.0
    }))  # fmt: skip

    def cosine(scan):
        rays = scan.cloud.points - scan.cloud.sensors
        return -(rays * scan.normals).sum(1) / np.linalg.norm(rays, axis=1)

    kept, all_of_it = cosine(seen), cosine(everything)
    assert kept.min() > 0.2 * 0.5 - 1e-6 and all_of_it.min() < 0.05
    between = [(c > 0.2).sum() - (c > 0.4).sum() for c in (kept, all_of_it)]
    assert 0.25 < between[0] / between[1] < 0.75
    assert (kept > 0.51).sum() == (all_of_it > 0.51).sum()


def test_a_floor_is_seen_around_the_object_but_not_under_it():
    box = trimesh.creation.box((1.0, 0.8, 0.6))
    seen = look(box, ScanSettings(views=3, pixels=100, floor=True))
    floor = seen.face < 0
    assert 0.1 < floor.mean() < 0.95
    np.testing.assert_allclose(seen.cloud.points[floor, 1], -0.4, atol=1e-9)
    inside = (np.abs(seen.cloud.points[floor][:, [0, 2]]) < [0.49, 0.29]).all(1)
    assert not inside.any()


@pytest.mark.parametrize("category", ["chair", "car", "plane", "table"])
def test_a_members_scan_knows_its_surface_coordinates(category):
    member = get_family(category).member(1_000_001)
    mesh = tessellate(member)
    seen = simulate_scan(
        mesh.vertices, mesh.faces, ScanSettings(pixels=60), np.random.default_rng(0)
    )
    there = member.locate(mesh.at(seen.face, seen.second, seen.third))
    assert there.exists.mean() > 0.99
    assert np.quantile(np.linalg.norm(there.points - seen.cloud.points, axis=1), 0.9) < 0.003


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (ScanSettings(views=0), "views 0 must be 1 or more"),
        (ScanSettings(noise=-1.0), "noise -1"),
        (ScanSettings(noise=float("nan")), "noise nan"),
        (ScanSettings(grazing=2.0), "0 to 90°"),
        (ScanSettings(distance=0.4), "within the object; give a distance above 0.50"),
    ],
)
def test_settings_without_sense_are_refused(settings, message):
    with pytest.raises(DataError, match=message):
        look(settings=settings)


def test_points_lie_on_the_triangles_that_were_hit():
    place = pose(1.0, 300.0, (5, 6, 7))
    scan, mesh = (
        scan_of("chair", CHAIR, place, views=2, noise=0.0, pixels=60),
        triangles("chair", CHAIR),
    )
    a, b, c = (mesh.vertices[mesh.faces[scan.face, i]] for i in range(3))
    second, third = scan.second[:, None], scan.third[:, None]
    true = a + second * (b - a) + third * (c - a)
    np.testing.assert_allclose(place.to_canonical(scan.cloud.points), true, atol=1e-6)
    assert set(scan.view) == {0, 1} and scan.cloud.sensors.shape == (2, 3)
    toward = scan.cloud.sensors[scan.view] - scan.cloud.points
    assert ((toward * scan.normals).sum(1) > 0).all()


def test_noise_moves_points_and_the_floor_belongs_to_no_triangle():
    still, noisy = (
        scan_of("chair", CHAIR, views=1, noise=noise, pixels=60, floor=True) for noise in (0, 0.01)
    )
    assert (still.face == -1).any() and (still.face >= 0).any()
    height = pose(0.7).to_canonical(still.cloud.points[still.face == -1])[:, 1]
    assert np.ptp(height) < 1e-6
    assert len(noisy.cloud) == len(still.cloud)
    moved = np.linalg.norm(noisy.cloud.points - still.cloud.points, axis=1)
    assert 0.003 < moved.mean() < 0.03


def test_settings_that_make_no_sense_are_refused():
    mesh, rng = triangles("chair", CHAIR), np.random.default_rng(0)
    with pytest.raises(DataError, match="views 0 must be 1 or more; noise -1 must be 0 or more"):
        simulate_scan(mesh.vertices, mesh.faces, ScanSettings(views=0, noise=-1), rng)
    with pytest.raises(DataError, match="stand within the object"):
        simulate_scan(mesh.vertices, mesh.faces, ScanSettings(distance=0.3), rng)
