"""The benchmark's folders, its wrong labels, and what is missing."""

from __future__ import annotations

import numpy as np
import pytest

from bsrc_folder import member_clouds, write_bsrc
from nrdf.benchmark.bsrc import ROIS, ordered_pairs, read_bsrc
from nrdf.errors import DataError


@pytest.fixture
def root(tmp_path):
    return write_bsrc(tmp_path / "bsrc", "chair", member_clouds("chair", (0, 1, 2)))


def test_objects_come_with_normals_and_all_regions(root):
    objects = read_bsrc(root, "chair")
    assert [item.name for item in objects] == ["chair1", "chair2", "chair3"]
    for item, (points, regions) in zip(objects, member_clouds("chair", (0, 1, 2)), strict=True):
        np.testing.assert_allclose(item.cloud.points, points, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(item.cloud.normals, axis=1), 1, atol=1e-6)
        assert tuple(item.regions) == ROIS["chair"]
        for found, expected in zip(item.regions.values(), regions, strict=True):
            np.testing.assert_allclose(found, points[expected], atol=1e-6)


def test_every_ordered_pair_of_different_objects(root):
    pairs = [(a.name, b.name) for a, b in ordered_pairs(read_bsrc(root, "chair"))]
    assert len(pairs) == len(set(pairs)) == 6
    assert all(a != b for a, b in pairs)


def test_corrected_labels_exchange_the_wings_of_plane5_only(tmp_path):
    clouds = member_clouds("plane", (0, 1), 400) * 3
    root = write_bsrc(tmp_path, "plane", clouds[:5])
    published, corrected = (
        {item.name: item.regions for item in read_bsrc(root, "plane", labels)}
        for labels in ("published", "corrected")
    )
    for name, regions in corrected.items():
        exchanged = {"5rt": "5rb", "5rb": "5rt", "6bt": "6bb", "6bb": "6bt"}
        assert tuple(regions) == ROIS["plane"]
        for roi, points in regions.items():
            other = exchanged.get(roi, roi) if name == "plane5" else roi
            np.testing.assert_array_equal(points, published[name][other])
    assert not np.array_equal(published["plane5"]["5rt"], corrected["plane5"]["5rt"])


@pytest.mark.parametrize("file", ["cropped_5b.ply", "obj_pcd.ply"])
def test_a_missing_file_is_named(root, file):
    (root / "Chair" / "chair2" / file).unlink()
    with pytest.raises(DataError, match=rf"chair2 is not complete: no file .*chair2/{file}"):
        read_bsrc(root, "chair")


def test_folders_that_are_no_benchmark_are_refused(root, tmp_path):
    with pytest.raises(DataError, match=r"no BSRC objects in .*expected folders such as .*car1"):
        read_bsrc(root, "car")
    (tmp_path / "one" / "Chair").mkdir(parents=True)
    with pytest.raises(DataError, match="holds 0 objects; a pair needs at least two"):
        read_bsrc(tmp_path / "one", "chair")


def test_unknown_names_are_refused_with_the_known_ones(root):
    with pytest.raises(DataError, match="no BSRC category 'table'; known: chair, car, plane"):
        read_bsrc(root, "table")
    with pytest.raises(DataError, match="known: published, corrected"):
        read_bsrc(root, "chair", "right")
