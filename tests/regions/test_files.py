"""Region files: clouds, masks and indices in; one cloud for each match out."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import RegionError
from nrdf.io.cloud import PointCloud, read_cloud, write_cloud
from nrdf.regions.files import read_regions, write_matches
from nrdf.regions.match import Match


def test_every_form_of_a_region_is_read_by_its_name(tmp_path):
    points = np.random.default_rng(0).random((5, 3))
    write_cloud(tmp_path / "seat.ply", PointCloud(points))
    np.save(tmp_path / "mask.npy", np.arange(9) > 4)
    np.savez(tmp_path / "more.npz", legs=np.array([1, 2]), rail=np.array([3]))
    files = [tmp_path / name for name in ("seat.ply", "mask.npy", "more.npz")]
    found = read_regions(files)
    assert list(found) == ["seat", "mask", "legs", "rail"]
    np.testing.assert_allclose(found["seat"], points, atol=1e-6)
    assert found["mask"].dtype == bool and found["legs"].tolist() == [1, 2]


def test_points_come_in_the_references_unit(tmp_path):
    write_cloud(tmp_path / "seat.ply", PointCloud(np.full((5, 3), 250.0), unit="mm"))
    found = read_regions([tmp_path / "seat.ply"], unit="m")
    np.testing.assert_allclose(found["seat"], 0.25)


def test_what_is_no_region_is_refused_with_its_name(tmp_path):
    with pytest.raises(RegionError, match="no region given"):
        read_regions([])
    np.save(tmp_path / "a.npy", np.zeros((2, 2)))
    with pytest.raises(RegionError, match=r"'a' is \(2, 2\) of float64; a region is a mask"):
        read_regions([tmp_path / "a.npy"])
    (tmp_path / "x").mkdir()
    for folder in (tmp_path, tmp_path / "x"):
        np.save(folder / "seat.npy", np.arange(3))
    with pytest.raises(RegionError, match="two regions are called 'seat'"):
        read_regions([tmp_path / "seat.npy", tmp_path / "x" / "seat.npy"])


def test_a_match_is_written_as_the_targets_points(tmp_path):
    target = PointCloud(np.random.default_rng(0).random((6, 3)))
    match = Match(np.array([1, 4]), np.zeros((1, 3)), np.array([0.5, 1.0]), "mask")
    write_matches(tmp_path, target, {"seat": match})
    written = read_cloud(tmp_path / "seat.ply")
    np.testing.assert_allclose(written.points, target.points[[1, 4]], atol=1e-6)
