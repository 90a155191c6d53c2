"""Point clouds: what they check, and reading and writing them."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from builders.cloud_files import NORMALS, POINTS, WITH_NORMALS, ply_header
from nrdf.errors import CloudError, OutputError
from nrdf.io.cloud import PointCloud, check_cloud, read_cloud, write_cloud
from nrdf.scans.clean import clean_scan


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.xyz", WITH_NORMALS.encode()),
        (
            "a.ply",
            ply_header(properties=[f"float {a}" for a in ("x", "y", "z", "nx", "ny", "nz")])
            + WITH_NORMALS.encode(),
        ),
        (
            "a.pcd",
            b"FIELDS x y z normal_x normal_y normal_z\nVERSION 7\nSIZE 4 4 4 4 4 4\n"
            b"TYPE F F F F F F\nPOINTS 4\nDATA ascii\n" + WITH_NORMALS.encode(),
        ),
    ],
)
def test_normals_in_a_file_are_used(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    np.testing.assert_allclose(read_cloud(tmp_path / name).normals, NORMALS)


def test_missing_normals_leave_all_out(tmp_path, caplog):
    normals = NORMALS.copy()
    normals[2] = 0.0
    np.savez(tmp_path / "a.npz", points=POINTS, normals=normals)
    assert read_cloud(tmp_path / "a.npz").normals is None
    assert "left out" in caplog.text


@settings(max_examples=40, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 30), st.just(3)),
           elements=st.floats(-1e6, 1e6)),
    st.booleans(),
    st.sampled_from([None, "m", "mm"]),
)  # fmt: skip
def test_written_clouds_come_back(tmp_path_factory, points, with_normals, unit):
    path = tmp_path_factory.getbasetemp() / "round.ply"
    normals = np.tile([0.0, -1.0, 0.0], (len(points), 1)) if with_normals else None
    write_cloud(path, PointCloud(points, normals, unit, "the scanner's"))
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud.points, points)
    assert (cloud.normals is None) != with_normals
    assert (cloud.unit, cloud.frame) == (unit, "the scanner's")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"colours": np.zeros((4, 3))}, "uint8"),
        ({"scalars": {"c": np.zeros(3)}}, "shape"),
        ({"scalars": {"two words": np.zeros(4)}}, "name"),
        ({"scalars": {"x": np.zeros(4)}}, "name"),
    ],
)
def test_arrays_that_do_not_fit_a_cloud_are_refused(tmp_path, options, message):
    with pytest.raises(CloudError, match=message):
        write_cloud(tmp_path / "a.ply", PointCloud(POINTS), **options)
    assert not list(tmp_path.iterdir())


def test_writing_where_one_cannot_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        write_cloud(tmp_path / "nowhere" / "a.ply", PointCloud(POINTS))
    (tmp_path / "folder.ply").mkdir()
    with pytest.raises(OutputError, match=r"folder\.ply"):
        write_cloud(tmp_path / "folder.ply", PointCloud(POINTS))
    assert [p.name for p in tmp_path.iterdir()] == ["folder.ply"]


@pytest.mark.parametrize(("bad", "kept"), [(0, True), (9, True), (10, False), (1000, False)])
def test_a_few_points_that_are_not_finite_are_dropped(tmp_path, caplog, bad, kept):
    points = np.random.default_rng(0).random((1000, 3))
    points[:bad, 1] = np.nan
    points[bad // 2 : bad, 1] = np.inf
    np.save(tmp_path / "a.npy", points)
    if not kept:
        with pytest.raises(CloudError, match=f"{bad} of 1000"):
            read_cloud(tmp_path / "a.npy")
        return
    with caplog.at_level(logging.WARNING):
        assert len(read_cloud(tmp_path / "a.npy")) == 1000 - bad
    assert ("dropped 9 points" in caplog.text) == (bad == 9)


def test_clouds_that_cannot_be_used_are_refused():
    rng = np.random.default_rng(0)
    whole = rng.random((500, 3))
    check_cloud(PointCloud(whole), 500)
    check_cloud(PointCloud(whole * [1, 0.01, 1] + 1e4), 500)
    cases = [
        (whole[:0], "no points"),
        (whole[:499], "has 499 points; at least 500"),
        (np.ones((500, 3)) * 7.1, "coincide"),
        (whole @ np.array([[1, 2, 3], [0, 1, 1], [1, 3, 4]]) / 3 + 100.0, "is flat"),
        (whole[:, :1] * [1.0, 2.0, -1.0] + 5, "is collinear"),
        (np.where(np.arange(500)[:, None] == 3, np.nan, whole), "NaN"),
    ]
    for points, message in cases:
        with pytest.raises(CloudError, match=message):
            check_cloud(PointCloud(points), 500)


def test_a_cloud_checks_its_shapes_and_selects():
    cloud = PointCloud(POINTS.tolist(), NORMALS, "mm", "base")
    chosen = cloud.select(np.array([True, False, True, False]))
    np.testing.assert_array_equal(chosen.points, POINTS[[0, 2]])
    np.testing.assert_array_equal(chosen.normals, NORMALS[[0, 2]])
    assert (len(chosen), chosen.unit, chosen.frame) == (2, "mm", "base")
    for points, normals in ((POINTS[:, :2], None), (POINTS, NORMALS[:2]), (POINTS.ravel(), None)):
        with pytest.raises(CloudError):
            PointCloud(points, normals)


WHOLE = np.random.default_rng(0).normal(size=(300, 3))


@pytest.mark.parametrize(
    ("cloud", "words"),
    [
        (PointCloud(1e30 * WHOLE), "at most 1e[+]12 are read"),
        (PointCloud(1e160 * WHOLE), "at most 1e[+]12 are read"),
        (PointCloud(1e-160 * WHOLE), "at least 1e-09 is needed"),
        (PointCloud(WHOLE, np.full((300, 3), np.nan)), "300 of the cloud's 300 normals are zero"),
        (PointCloud(WHOLE, np.eye(300, 3)), "297 of the cloud's 300 normals are zero"),
    ],
)
def test_what_numbers_cannot_hold_is_refused(cloud, words):
    for check in (lambda: check_cloud(cloud, 256), lambda: clean_scan(cloud)):
        with pytest.raises(CloudError, match=words):
            check()


@pytest.mark.parametrize("length", [1e-5, 0.5, 1.01, 1e160, 1e300])
def test_normals_are_brought_to_unit_length(length):
    unit = WHOLE / np.linalg.norm(WHOLE, axis=1, keepdims=True)
    np.testing.assert_allclose(PointCloud(WHOLE, length * unit).normals, unit, atol=1e-12)
    assert np.array_equal(PointCloud(WHOLE, unit).normals, unit)


@pytest.mark.parametrize("place", [np.nan, np.inf, 1e30])
def test_sensors_that_stand_nowhere_are_refused(place):
    with pytest.raises(CloudError, match="a sensor's place is"):
        PointCloud(WHOLE, sensors=[[0.0, place, 0.0]])
    with pytest.raises(CloudError, match="sensors must have the shape"):
        PointCloud(WHOLE, sensors=[1.0, 2.0])
