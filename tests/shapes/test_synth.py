"""Training shapes of families: exact, resumable, extensible."""

from __future__ import annotations

import numpy as np
import pytest

from nrdf.errors import DataError, OutputError
from nrdf.shapes import synth
from nrdf.shapes.dataset import (
    IndexRow,
    add_to_index,
    read_index,
    read_shape,
    read_stamp,
    shape_paths,
    write_index,
)
from nrdf.shapes.families import get_family
from nrdf.shapes.synth import member_shape, synthesise

EPS = 3e-5


@pytest.fixture(scope="module", autouse=True)
def small():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(synth, "SURFACE_POINTS", 500)
        patch.setattr(synth, "QUERIES", 400)
        patch.setattr(synth, "CORRESPONDENCES", 300)
        synth._canonical_coordinates.cache_clear()
        yield
    synth._canonical_coordinates.cache_clear()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("tables") / "new" / "folder"
    told = []
    assert synthesise("table", 4, out, seed=17, progress=lambda *a: told.append(a)) == 4
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    return out


def test_files_hold_exact_members(folder):
    for seed, path in zip(range(17, 21), shape_paths(folder), strict=True):
        shape = read_shape(path)
        member = get_family("table").member(seed)
        assert (shape.name, shape.category, shape.source) == (
            f"family-table-{seed:06d}",
            "table",
            "family",
        )
        points, normals = shape.surface_points.astype(float), shape.surface_normals.astype(float)
        assert points.shape == normals.shape == (500, 3)
        behind, ahead = points - EPS * normals, points + EPS * normals
        assert (member.occupancy(behind) & ~member.occupancy(ahead)).mean() > 0.99
        assert shape.query_points.shape == (400, 3) and shape.query_points.dtype == np.float16
        np.testing.assert_array_equal(
            shape.query_occupancies, member.occupancy(shape.query_points.astype(float))
        )
        assert 0.02 < shape.query_occupancies.mean() < 0.9


def test_index_i_is_the_same_place_on_every_member(folder):
    coordinates = synth._canonical_coordinates("table")
    groups = []
    for seed, path in zip(range(17, 21), shape_paths(folder), strict=True):
        group = read_shape(path).correspondences["family-table"]
        located = get_family("table").member(seed).locate(coordinates)
        assert group.points.shape == (300, 3)
        np.testing.assert_array_equal(group.weight, located.exists)
        here = located.exists
        np.testing.assert_allclose(group.points[here], located.points[here], atol=1e-6)
        np.testing.assert_allclose(group.normals[here], located.normals[here], atol=1e-6)
        groups.append(group)
    both = (groups[0].weight > 0) & (groups[1].weight > 0)
    assert both.mean() > 0.2 and any((group.weight == 0).any() for group in groups)
    # On the tops of two tables the same index lies at the same place of the top.
    tops = [
        np.abs(group.points[:, 1] - group.points[group.weight > 0, 1].max()) < 1e-3
        for group in groups[:2]
    ]
    on_top = both & tops[0] & tops[1]
    assert on_top.sum() > 10
    left = groups[0].points[on_top, 2]
    assert np.corrcoef(left, groups[1].points[on_top, 2])[0, 1] > 0.9


def test_one_in_twenty_is_for_validation(folder):
    rows = {row.name: row for row in read_index(folder)}
    splits = {name: row.split for name, row in rows.items()}
    assert splits.pop("family-table-000019") == "val"
    assert set(splits.values()) == {"train"}
    assert {row.licence for row in rows.values()} == {"MIT"}


def test_a_run_goes_on_where_it_was_killed(folder):
    paths = shape_paths(folder)
    before = [path.read_bytes() for path in paths]
    untouched = {path: path.stat().st_mtime_ns for path in paths[:2]}
    paths[2].unlink()
    paths[3].write_bytes(before[3][:-100])
    assert synthesise("table", 4, folder, seed=17) == 2
    assert [path.read_bytes() for path in paths] == before
    assert {path: path.stat().st_mtime_ns for path in paths[:2]} == untouched
    assert synthesise("table", 4, folder, seed=17) == 0


def test_shapes_with_correspondences_added_are_kept(tmp_path):
    synthesise("table", 1, tmp_path)
    path = shape_paths(tmp_path)[0]
    stamp = read_stamp(path)
    synth.write_shape(path, read_shape(path), f"{stamp}+templates")
    assert synthesise("table", 1, tmp_path) == 0
    assert read_stamp(path) == f"{stamp}+templates"


def test_a_larger_run_extends_a_smaller_one(tmp_path):
    synthesise("table", 1, tmp_path, seed=5)
    other = IndexRow("mine", "scanner", "val", "CC0")
    add_to_index(tmp_path, [other])
    first = shape_paths(tmp_path)[0].read_bytes()
    assert synthesise("table", 3, tmp_path, seed=5) == 2
    rows = read_index(tmp_path)
    assert [row.name for row in rows] == [*(f"family-table-00000{i}" for i in (5, 6, 7)), "mine"]
    assert rows[-1] == other
    assert shape_paths(tmp_path)[0].read_bytes() == first


def test_a_row_of_the_same_name_is_replaced(tmp_path):
    write_index(tmp_path, [IndexRow("a", "x", "train", "MIT"), IndexRow("b", "x", "val", "MIT")])
    add_to_index(tmp_path, [IndexRow("b", "y", "test", "CC0")])
    assert read_index(tmp_path) == [
        IndexRow("a", "x", "train", "MIT"),
        IndexRow("b", "y", "test", "CC0"),
    ]


def test_a_seed_fixes_a_shape():
    one, two = member_shape("table", 3), member_shape("table", 3)
    np.testing.assert_array_equal(one.surface_points, two.surface_points)
    np.testing.assert_array_equal(one.query_points, two.query_points)


def test_what_cannot_be_made_is_refused(tmp_path):
    with pytest.raises(DataError, match="no family 'boat'; known: chair"):
        synthesise("boat", 3, tmp_path / "out")
    with pytest.raises(DataError, match="0 shapes asked for; give at least 1"):
        synthesise("table", 0, tmp_path / "out")
    with pytest.raises(DataError, match="must not be negative, this one is -2"):
        synthesise("table", 1, tmp_path / "out", seed=-2)
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot make .*file"):
        synthesise("table", 1, tmp_path / "file")
