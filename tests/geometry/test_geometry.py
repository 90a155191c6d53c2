import time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from nrdf.errors import CloudError
from nrdf.geometry.canonical import bounding_box, canonical_transform
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample, fibonacci_directions
from nrdf.geometry.visibility import seen_from_both_sides, visibility
from nrdf.scans.simulate import ScanSettings, simulate_scan


def sphere(rng, count, radius=0.5):
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return radius * normals, normals


def box(rng, count, sides):
    """Points and normals on the surface of a box, evenly over its area."""
    sides = np.asarray(sides, float)
    area = np.array([sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]])
    axis = rng.choice(3, count, p=area / area.sum())
    points = (rng.random((count, 3)) - 0.5) * sides
    sign = rng.choice([-1.0, 1.0], count)
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = sign
    points[np.arange(count), axis] = sign * sides[axis] / 2
    return points, normals


def bent_shell(rng, count, thickness=0.022):
    """A third of a tube's wall, open at both ends: a bent chair back."""
    outside = rng.random(count) < 0.5
    angle = rng.uniform(-1.0, 1.0, count)
    radius = np.where(outside, 0.5, 0.5 - thickness)
    radial = np.stack([np.cos(angle), np.zeros(count), np.sin(angle)], axis=1)
    points = radius[:, None] * radial + rng.uniform(-0.5, 0.5, (count, 1)) * [0.0, 1.0, 0.0]
    return points, np.where(outside[:, None], radial, -radial)


@settings(max_examples=50, deadline=None)
@given(
    st.integers(2, 40),
    st.floats(1e-3, 1e3),
    st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    st.integers(0, 1000),
)
def test_canonical_points_fill_a_unit_box(count, size, shift, seed):
    points = np.random.default_rng(seed).normal(size=(count, 3)) * size + shift
    centre, scale = canonical_transform(points)
    lowest, highest = bounding_box((points - centre) / scale)
    np.testing.assert_allclose(lowest, -highest, atol=1e-9)
    assert (highest - lowest).max() == pytest.approx(1.0)


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.ones((5, 3)), np.full((3, 3), np.nan)])
def test_points_without_extent_have_no_canonical_frame(points):
    with pytest.raises(CloudError):
        canonical_transform(points)


def test_directions_are_unit_and_even():
    directions = fibonacci_directions(60)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.linalg.norm(directions.mean(axis=0)) < 0.01
    cosine = directions @ directions.T - 2 * np.eye(60)
    assert np.degrees(np.arccos(cosine.max(axis=1))).min() > 20


@pytest.mark.parametrize(
    "count", [pytest.param(5, id="few"), pytest.param(1000, id="some"), 19_999, 20_000, 30_000]
)
def test_thinning_keeps_as_many_points_as_asked(count):
    points, _ = sphere(np.random.default_rng(0), 20_000)
    index = downsample(points, count, np.random.default_rng(1))
    assert len(index) == min(count, 20_000) == len(set(index))
    assert (np.diff(index) > 0).all()


def test_thinning_evens_out_the_density():
    rng = np.random.default_rng(0)
    points, _ = sphere(rng, 60_000)
    dense_above = points[(points[:, 1] > 0) | (rng.random(60_000) < 0.03)]
    above = dense_above[downsample(dense_above, 400, rng), 1] > 0
    assert (dense_above[:, 1] > 0).mean() > 0.95
    assert 0.4 < above.mean() < 0.65


def test_thinning_copes_with_coincident_points():
    points = np.repeat(np.eye(3), 50, axis=0)
    assert len(downsample(points, 10, np.random.default_rng(0))) == 10
    assert len(downsample(np.zeros((100, 3)), 10, np.random.default_rng(0))) == 10


def test_thinning_ten_million_points_is_quick():
    points = np.random.default_rng(0).random((10_000_000, 3), dtype=np.float32)
    points[:, 1] = 0.0
    start = time.process_time()
    index = downsample(points, 8192, np.random.default_rng(1))
    assert time.process_time() - start < 8.0  # 2 s on an idle core
    for corner in (points[index] < 0.25, points[index] > 0.75):
        assert corner[:, [0, 2]].all(axis=1).mean() == pytest.approx(1 / 16, rel=0.2)


def test_thinning_takes_points_that_fill_a_volume():
    points = np.random.default_rng(0).random((300_000, 3))
    index = downsample(points, 1000, np.random.default_rng(1))
    assert len(index) == 1000
    assert (points[index] < 0.5).all(axis=1).mean() == pytest.approx(1 / 8, abs=0.04)


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


def test_visibility_tells_the_outer_side_and_finds_buried_points():
    rng = np.random.default_rng(0)
    outer, outer_normals = sphere(rng, 6000)
    inner, inner_normals = sphere(rng, 1000, radius=0.3)
    points = np.concatenate([outer, inner])
    given_normals = np.concatenate([outer_normals, inner_normals])
    given_normals[:6000:3] *= -1
    vote, front, back = visibility(points, given_normals)
    outward = (given_normals * points).sum(axis=1) > 0
    assert ((vote > 0) == outward)[:6000].all()
    seen, unseen = np.where(outward, front, back), np.where(outward, back, front)
    assert (seen[:6000] >= 10).mean() > 0.999
    assert unseen[:6000].mean() < 1.0
    assert (np.maximum(front, back)[6000:] < 3).mean() > 0.95


def test_both_sides_are_seen_of_an_open_surface_only():
    rng = np.random.default_rng(0)
    points, normals = box(rng, 6000, (1.0, 0.05, 0.8))
    assert not seen_from_both_sides(points, normals).any()
    bowl, lines = sphere(rng, 6000)
    dish = bowl[:, 1] < -0.3
    assert seen_from_both_sides(bowl[dish], lines[dish]).mean() > 0.8
    flask = bowl[:, 1] < 0.4  # a small hole changes nothing
    assert not seen_from_both_sides(bowl[flask], lines[flask]).any()


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
