"""The benchmark's folders, its wrong labels, and what is missing."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from builders.bsrc_folder import NO_DEV_HALF, dev_half, member_clouds, write_bsrc
from nrdf.errors import DataError
from nrdf.io.cloud import PointCloud, write_cloud
from nrdf_benchmark.bsrc.dataset import CORRECTIONS, OPPOSITE_SIDES, ROIS, read_bsrc


@pytest.fixture
def root(tmp_path):
    return write_bsrc(tmp_path / "bsrc", "chair", member_clouds("chair", (0, 1, 2)))


def test_objects_come_with_normals_and_all_regions(root):
    objects = read_bsrc(root, "chair").objects
    assert [item.name for item in objects] == ["chair1", "chair2", "chair3"]
    for item, (points, regions) in zip(objects, member_clouds("chair", (0, 1, 2)), strict=True):
        np.testing.assert_allclose(item.cloud.points, points, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(item.cloud.normals, axis=1), 1, atol=1e-6)
        assert tuple(item.regions) == tuple(item.truth) == ROIS["chair"]
        for roi, expected in zip(ROIS["chair"], regions, strict=True):
            np.testing.assert_allclose(item.regions[roi], points[expected], atol=1e-6)
            np.testing.assert_array_equal(item.truth[roi], np.sort(expected))


def test_every_ordered_pair_of_different_objects(root):
    pairs = [(a.name, b.name) for a, b in read_bsrc(root, "chair").pairs]
    assert len(pairs) == len(set(pairs)) == 6
    assert all(a != b for a, b in pairs)


def test_any_subset_will_do_and_what_is_missing_is_named(root, caplog):
    chairs = root / "Chair"
    (chairs / "chair2").rename(chairs / "chair10")
    (chairs / "backup").mkdir()
    with caplog.at_level(logging.INFO, "nrdf_benchmark"):
        benchmark = read_bsrc(root, "chair")
    assert benchmark.numbers == [1, 3, 10] and benchmark.missing == [2, 4, 5, 6, 7, 8, 9]
    said = benchmark.describe()
    assert said.startswith("objects 1, 3, 10 of chair, 6 ordered pairs, labels as published")
    assert said.endswith("not there: 2, 4, 5, 6, 7, 8, 9")
    assert "chair2, chair4, chair5" in caplog.text
    assert "backup is left out: no name such as chair1" in caplog.text


def test_the_development_half_is_called_so(root):
    chairs = root / "Chair"
    for number in (5, 7, 9):
        (chairs / f"chair{number}").symlink_to(chairs / "chair1")
    (chairs / "chair2").rename(root / "chair2")
    assert "of chair (the development half), 20" in read_bsrc(root, "chair").describe()
    for number in (2, 4, 6, 8, 10):
        (chairs / f"chair{number}").symlink_to(chairs / "chair1")
    assert (
        read_bsrc(root, "chair")
        .describe()
        .endswith("9, 10 of chair (the whole benchmark), 90 ordered pairs, labels as published")
    )


def test_objects_are_equal_if_all_their_files_are(root):
    first, second, _ = read_bsrc(root, "chair").objects
    again = read_bsrc(root, "chair").objects[0]
    assert first == again and hash(first) == hash(again) and first != second
    (root / "Chair" / "chair1" / "cropped_3.ply").write_bytes(
        (root / "Chair" / "chair1" / "cropped_1.ply").read_bytes()
    )
    assert first != read_bsrc(root, "chair").objects[0]


def test_corrected_labels_exchange_the_wings_of_plane5_only(tmp_path):
    clouds = member_clouds("plane", (0, 1), 400) * 3
    root = write_bsrc(tmp_path, "plane", clouds[:5])
    published, corrected = (
        {item.name: item for item in read_bsrc(root, "plane", labels).objects}
        for labels in ("published", "corrected")
    )
    exchanged = {"5rt": "5rb", "5rb": "5rt", "6bt": "6bb", "6bb": "6bt"}
    for name, item in corrected.items():
        assert tuple(item.regions) == ROIS["plane"]
        for roi in ROIS["plane"]:
            other = exchanged.get(roi, roi) if name == "plane5" else roi
            np.testing.assert_array_equal(item.regions[roi], published[name].regions[other])
            np.testing.assert_array_equal(item.truth[roi], published[name].truth[other])
    assert published["plane5"] != corrected["plane5"]


@pytest.mark.skipif(dev_half() is None, reason=NO_DEV_HALF)
def test_the_evidence_for_each_correction():
    planes = {item.name: item for item in read_bsrc(dev_half(), "plane").objects}
    assert len(planes) > 3
    for correction in CORRECTIONS:
        assert correction.rois in OPPOSITE_SIDES[correction.category]
        for roi, up, around in zip(
            correction.rois, correction.evidence, correction.elsewhere, strict=True
        ):
            assert planes[correction.object].mean_up(roi) == pytest.approx(up, abs=0.02)
            others = [item.mean_up(roi) for name, item in planes.items() if name != "plane5"]
            assert (min(others), max(others)) == pytest.approx(around, abs=0.02)
            # The whole point: as labelled it faces the other way from all the others.
            assert all(other * up < 0 for other in others)


@pytest.mark.parametrize("file", ["cropped_5b.ply", "obj_pcd.ply"])
def test_a_missing_file_is_named_with_what_was_expected(root, file):
    (root / "Chair" / "chair2" / file).unlink()
    message = rf"chair2 is not complete: no file .*chair2/{file}; expected .* regions 1, 2b, 2f"
    with pytest.raises(DataError, match=message):
        read_bsrc(root, "chair")


def test_a_region_without_points_is_named(root):
    file = root / "Chair" / "chair3" / "cropped_7r.ply"
    write_cloud(file, PointCloud(np.zeros((0, 3))))
    message = (
        r"chair3/cropped_7r.ply: .*no points \(BSRC's region 7r of chair3\); expected at least"
    )
    with pytest.raises(DataError, match=message):
        read_bsrc(root, "chair")


def test_a_region_that_is_not_on_its_object_is_named(root):
    file = root / "Chair" / "chair1" / "cropped_1.ply"
    write_cloud(file, PointCloud(np.full((5, 3), 3.0)))
    message = r"chair1/cropped_1.ply: 5 of .* not on the reference.*some of .*chair1/obj_pcd.ply"
    with pytest.raises(DataError, match=message):
        read_bsrc(root, "chair")


def test_folders_that_are_no_benchmark_are_refused(root, tmp_path):
    with pytest.raises(DataError, match=r"no BSRC objects in .*expected folders such as .*car1"):
        read_bsrc(root, "car")
    with pytest.raises(DataError, match=r"there is no folder .*nowhere; expected folders"):
        read_bsrc(root / "nowhere", "chair")
    with pytest.raises(DataError, match=r"Chair is a category's own folder, give the one above"):
        read_bsrc(root / "Chair", "chair")
    (tmp_path / "one" / "Chair").mkdir(parents=True)
    with pytest.raises(DataError, match="holds 0 objects; a pair needs at least two"):
        read_bsrc(tmp_path / "one", "chair")


def test_unknown_names_are_refused_with_the_known_ones(root):
    with pytest.raises(DataError, match="no BSRC category 'table'; known: chair, car, plane"):
        read_bsrc(root, "table")
    with pytest.raises(DataError, match="known: published, corrected"):
        read_bsrc(root, "chair", "right")
