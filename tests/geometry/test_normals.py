"""Estimated normals point outwards, or to the sensor that saw the point."""

from __future__ import annotations

import time

import numpy as np
import pytest
import trimesh

from builders.oriented_clouds import bent_shell, box, sphere
from nrdf.errors import CloudError
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.scans.simulate import ScanSettings, simulate_scan


@pytest.mark.parametrize(
    ("make", "sign", "angle"),
    [
        pytest.param(lambda r: sphere(r, 8192), 1.0, 3.0, id="sphere"),
        pytest.param(lambda r: box(r, 8192, (1.0, 0.8, 0.6)), 0.9999, 5.0, id="box"),
        pytest.param(lambda r: box(r, 8192, (0.9, 0.9, 0.02)), 0.995, 6.0, id="thin plate"),
        pytest.param(lambda r: bent_shell(r, 8192), 0.99, 6.0, id="bent thin shell"),
        pytest.param(lambda r: box(r, 2048, (1.0, 0.05, 0.05)), 0.99, 12.0, id="leg"),
    ],
)
def test_estimated_normals_point_outwards(make, sign, angle):
    points, truth = make(np.random.default_rng(3))
    normals = estimate_normals(points)
    assert normals.dtype == np.float64
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)
    cosine = (normals * truth).sum(axis=1)
    assert (cosine > 0).mean() >= sign
    assert np.degrees(np.arccos(np.clip(np.abs(cosine), 0, 1))).mean() < angle


def test_estimated_normals_do_not_depend_on_unit_or_place():
    points, truth = box(np.random.default_rng(0), 3000, (1.0, 0.5, 0.1))
    normals = estimate_normals(points * 1000.0 + [5e4, -3e3, 200.0])
    assert ((normals * truth).sum(axis=1) > 0).mean() > 0.99


def test_estimating_normals_of_8192_points_takes_a_third_of_a_second():
    points, _ = bent_shell(np.random.default_rng(0), 8192)
    estimate_normals(points)
    times = []
    for _ in range(3):
        start = time.process_time()
        estimate_normals(points)
        times.append(time.process_time() - start)
    assert min(times) < 0.6  # 0.15 s on an idle core


@pytest.mark.parametrize("count", [4, 5, 9, 30])
def test_few_points_still_get_normals(count):
    points, truth = sphere(np.random.default_rng(0), count)
    assert np.isfinite(estimate_normals(points)).all()
    if count == 30:
        assert ((estimate_normals(points) * truth).sum(axis=1) > 0).mean() > 0.9


def test_too_few_points_are_refused():
    with pytest.raises(CloudError, match="at least 4"):
        estimate_normals(np.eye(3))


def test_coincident_points_do_not_upset_the_normals():
    points, truth = sphere(np.random.default_rng(0), 1000)
    points = np.concatenate([points, np.repeat(points[:1], 40, axis=0)])
    normals = estimate_normals(points)
    assert np.isfinite(normals).all()
    assert ((normals[:1000] * truth).sum(axis=1) > 0).mean() > 0.99


def test_normals_of_a_partial_cloud_point_to_the_sensors_that_saw_it():
    bench = trimesh.util.concatenate(
        [
            trimesh.creation.box((0.5, 0.03, 0.5)),
            trimesh.creation.box((0.03, 0.5, 0.5), trimesh.transformations.translation_matrix(
                (-0.25, 0.25, 0))),
        ]
    )  # fmt: skip
    for views, least in ((1, 0.99), (3, 0.95)):
        seen = simulate_scan(
            bench.vertices, bench.faces, ScanSettings(views=views), np.random.default_rng(1)
        )
        chosen = downsample(seen.cloud.points, 4000, np.random.default_rng(0))
        away = np.array([5.0, 0.0, 0.0])
        points, true = seen.cloud.points[chosen] + away, seen.normals[chosen]
        sensors = seen.cloud.sensors + away
        cosine = (estimate_normals(points, sensors=sensors) * true).sum(axis=1)
        assert (cosine > 0.5).mean() > least
        turned = 1000 * points[:, [1, 2, 0]]
        moved = estimate_normals(turned, sensors=1000 * sensors[:, [1, 2, 0]])
        assert ((moved * true[:, [1, 2, 0]]).sum(axis=1) > 0.5).mean() > least


def test_a_sensor_very_far_off_tells_sides_as_one_that_is_far():
    points, normals = box(np.random.default_rng(0), 3000, np.ones(3))
    corner = np.array([[1.0, 1.0, 1.0]])
    found = [estimate_normals(points, sensors=far * corner) for far in (50.0, 1e21)]
    seen = normals @ corner[0] > 0
    for estimated in found:
        assert (np.einsum("na,na->n", estimated, normals)[seen] > 0).mean() > 0.97


def test_a_sensor_at_a_point_and_most_points_in_one_place_give_normals():
    points = np.concatenate(
        [box(np.random.default_rng(0), 300, np.ones(3))[0], np.zeros((3000, 3))]
    )
    for sensors in (None, points[:1]):
        found = estimate_normals(points, sensors=sensors)
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-6)
