import dataclasses
import zipfile

import numpy as np
import pytest

from nrdf.errors import DataError, OutputError
from nrdf.shapes.dataset import (
    Correspondence,
    IndexRow,
    Shape,
    read_index,
    read_shape,
    read_stamp,
    shape_paths,
    write_index,
    write_shape,
)


def make_shape(queries: int = 21) -> Shape:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(10, 3)).astype(np.float32)
    return Shape(
        name="one",
        category="chair",
        source="somewhere",
        surface_points=points,
        surface_normals=points / np.linalg.norm(points, axis=1, keepdims=True),
        query_points=rng.random((queries, 3)).astype(np.float16),
        query_occupancies=rng.random(queries) > 0.5,
        correspondences={"family-chair": Correspondence(points, points, np.ones(10, np.float16))},
        loc=np.array([1.0, 2.0, 3.0]),
        scale=0.5,
    )


@pytest.mark.parametrize("queries", [1, 8, 21])
def test_a_shape_comes_back_as_it_was_written(tmp_path, queries):
    shape = make_shape(queries)
    write_shape(tmp_path / "one.npz", shape, stamp="v1")
    again = read_shape(tmp_path / "one.npz")
    for name in ("surface_points", "surface_normals", "query_points", "query_occupancies", "loc"):
        np.testing.assert_array_equal(getattr(again, name), getattr(shape, name))
        assert getattr(again, name).dtype == getattr(shape, name).dtype
    assert (again.name, again.category, again.source) == ("one", "chair", "somewhere")
    assert again.scale == 0.5
    group = again.correspondences["family-chair"]
    np.testing.assert_array_equal(group.points, shape.surface_points)
    assert group.weight.dtype == np.float16
    assert read_stamp(tmp_path / "one.npz") == "v1"


def test_the_file_is_uncompressed_and_needs_no_pickle(tmp_path):
    write_shape(tmp_path / "one.npz", make_shape())
    with zipfile.ZipFile(tmp_path / "one.npz") as archive:
        assert {info.compress_type for info in archive.infolist()} == {zipfile.ZIP_STORED}
        assert "pointcloud/points.npy" in archive.namelist()
    with np.load(tmp_path / "one.npz", allow_pickle=False) as arrays:
        assert arrays["points/occupancies"].dtype == np.uint8
        assert [arrays[key].dtype.kind for key in ("category", "source")] == ["U", "U"]


@pytest.mark.parametrize("name", ["points.npz", "bbx_points.npz"])
@pytest.mark.parametrize("packed", [True, False])
def test_an_occupancy_networks_folder_is_read(tmp_path, name, packed):
    shape = make_shape()
    folder = tmp_path / "03001627" / "abc"
    folder.mkdir(parents=True)
    np.savez(
        folder / "pointcloud.npz",
        points=shape.surface_points.astype(np.float16),
        normals=shape.surface_normals.astype(np.float16),
        loc=shape.loc,
        scale=shape.scale,
    )
    bits = shape.query_occupancies
    np.savez(
        folder / name,
        points=shape.query_points,
        occupancies=np.packbits(bits) if packed else bits.astype(np.float32),
    )
    again = read_shape(folder)
    assert (again.name, again.category, again.scale) == ("abc", "03001627", 0.5)
    assert again.surface_points.dtype == np.float32
    np.testing.assert_array_equal(again.query_occupancies, bits)


def test_a_folder_without_queries_names_the_missing_file(tmp_path):
    np.savez(tmp_path / "pointcloud.npz", points=np.zeros((4, 3)), normals=np.ones((4, 3)))
    with pytest.raises(DataError, match=r"points\.npz"):
        read_shape(tmp_path)


@pytest.mark.parametrize("length", [0, 10, 500, -1])
def test_a_truncated_file_is_refused(tmp_path, length):
    write_shape(tmp_path / "one.npz", make_shape())
    data = (tmp_path / "one.npz").read_bytes()
    (tmp_path / "one.npz").write_bytes(data[:length])
    assert read_stamp(tmp_path / "one.npz") is None
    with pytest.raises(DataError, match=r"one\.npz"):
        read_shape(tmp_path / "one.npz")


def test_arrays_that_do_not_fit_are_refused(tmp_path):
    shape = make_shape()
    wrong = [
        dataclasses.replace(shape, surface_normals=shape.surface_normals[:5]),
        dataclasses.replace(shape, query_occupancies=shape.query_occupancies[:-1]),
        dataclasses.replace(shape, surface_points=shape.surface_points * np.nan),
    ]
    for shape in wrong:
        with pytest.raises(DataError):
            write_shape(tmp_path / "one.npz", shape)
    assert not list(tmp_path.iterdir())
    np.savez(tmp_path / "two.npz", points=np.zeros((3, 3)))
    with pytest.raises(DataError, match="pointcloud/points"):
        read_shape(tmp_path / "two.npz")


def test_a_missing_folder_is_an_output_error(tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        write_shape(tmp_path / "nowhere" / "one.npz", make_shape())


def test_the_index_comes_back_sorted(tmp_path):
    rows = [IndexRow("b", "s", "train", "CC0, or so"), IndexRow("a", "s", "test", "")]
    write_index(tmp_path, rows)
    assert read_index(tmp_path) == rows[::-1]
    assert [path.name for path in shape_paths(tmp_path, "train")] == ["b.npz"]
    assert len(shape_paths(tmp_path)) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,source,split\na,b,train\n", "licence"),
        ("name,source,split,licence\na,b,trian,x\n", "trian"),
        ("name,source,split,licence\na,b,train,x\na,b,train,x\n", "twice"),
    ],
)
def test_a_wrong_index_is_refused(tmp_path, text, message):
    (tmp_path / "index.csv").write_text(text)
    with pytest.raises(DataError, match=message):
        read_index(tmp_path)


def test_a_folder_without_index_says_what_makes_one(tmp_path):
    with pytest.raises(DataError, match="nrdf model prepare"):
        read_index(tmp_path)
