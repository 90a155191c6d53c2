import os

import numpy as np
import pytest
import trimesh

from builders.box_chair import chair, inside_chair
from nrdf.errors import DataError, OutputError
from nrdf.shapes.dataset import IndexRow, read_index, read_shape, write_index
from nrdf.shapes.prepare import PrepareSettings, prepare_folder, prepare_mesh

SMALL = PrepareSettings(surface_points=512, queries=1024)


@pytest.fixture
def meshes(tmp_path):
    folder = tmp_path / "meshes"
    folder.mkdir()
    trimesh.creation.icosphere(3, 3.0).apply_translation([10, 0, 0]).export(folder / "ball.ply")
    chair().export(folder / "chair.obj")
    trimesh.creation.box((2.0, 1.0, 0.5)).export(folder / "box.stl")
    return folder


def test_a_prepared_chair_is_canonical_and_true(meshes):
    shape = prepare_mesh(meshes / "chair.obj", "chair", PrepareSettings())
    assert shape.surface_points.shape == shape.surface_normals.shape == (8192, 3)
    assert shape.query_points.shape == (16384, 3)
    extent = np.ptp(shape.surface_points, axis=0)
    assert 0.99 < extent.max() <= 1.0 + 1e-6
    original = shape.query_points.astype(float) * shape.scale + shape.loc
    assert (shape.query_occupancies == inside_chair(original)).mean() > 0.999
    behind = shape.surface_points - 2e-3 * shape.surface_normals
    assert inside_chair(behind * shape.scale + shape.loc).mean() > 0.99
    far = np.abs(shape.query_points.astype(float)).max(axis=1) > 0.5
    assert 0.05 < far[:8192].mean() < 0.3  # the padding
    assert np.abs(shape.query_points).max() < 0.8


def test_queries_are_half_uniform_and_half_near(meshes):
    shape = prepare_mesh(meshes / "ball.ply", "ball", PrepareSettings(queries=4000))
    radius = np.linalg.norm(shape.query_points.astype(float), axis=1)
    uniform, near = radius[:2000], radius[2000:]
    assert shape.query_occupancies[:2000].mean() == pytest.approx(0.5236 / 1.331, abs=0.04)
    assert np.abs(near - 0.5).mean() < 0.03 < np.abs(uniform - 0.5).mean()
    clear = np.abs(radius - 0.5) > 0.004  # more than the facets are off the sphere
    np.testing.assert_array_equal(shape.query_occupancies[clear], radius[clear] < 0.5)


def test_good_meshes_are_prepared_and_bad_ones_named(meshes, tmp_path):
    (meshes / "broken.ply").write_bytes(b"ply\nformat ascii 1.0\nelement vertex 9\n")
    (meshes / "empty.obj").write_bytes(b"")
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    sheet.export(meshes / "sheet.off")
    (meshes / "deeper").mkdir()
    chair().export(meshes / "deeper" / "chair.ply")
    told = []
    report = prepare_folder(
        meshes, tmp_path / "out", "chair", None, SMALL, 2, progress=lambda *a: told.append(a)
    )
    assert sorted(report.made) == ["ball", "box", "chair", "deeper-chair"]
    assert sorted(report.failed) == ["broken.ply", "empty.obj", "sheet.off"]
    assert "no volume" in report.failed["sheet.off"]
    assert report.exit_code == 1
    assert told[-1] == (7, 7)
    rows = read_index(tmp_path / "out")
    assert [row.name for row in rows] == sorted(report.made)
    assert {row.licence for row in rows} == {"unknown"}
    for row in rows:
        assert read_shape(tmp_path / "out" / f"{row.name}.npz").category == "chair"
    assert not list((tmp_path / "out").glob(".*"))
    prepare_folder(meshes, tmp_path / "alone", "chair", None, SMALL, workers=1)
    for one in (tmp_path / "out").iterdir():  # the number of processes makes no difference
        assert one.read_bytes() == (tmp_path / "alone" / one.name).read_bytes()


def test_a_second_run_keeps_what_is_there(meshes, tmp_path):
    out = tmp_path / "out"
    assert prepare_folder(meshes, out, "chair", settings=SMALL).exit_code == 0
    before = {p.name: (p.read_bytes(), p.stat().st_mtime_ns) for p in out.glob("*.npz")}
    (out / "box.npz").write_bytes(before["box.npz"][0][:2000])
    (out / ".ball.npz.x.part").write_bytes(b"half")
    os.utime(out / ".ball.npz.x.part", (0, 0))
    (out / ".new.npz.y.part").write_bytes(b"being written by another process")
    trimesh.creation.icosphere(2, 1.0).export(meshes / "ball.ply")
    report = prepare_folder(meshes, out, "chair", settings=SMALL)
    assert (sorted(report.made), report.kept) == (["ball", "box"], ["chair"])
    assert (out / "box.npz").read_bytes() == before["box.npz"][0]
    assert (out / "chair.npz").stat().st_mtime_ns == before["chair.npz"][1]
    assert [p.name for p in out.glob(".*")] == [".new.npz.y.part"]
    assert len(read_index(out)) == 3
    changed = PrepareSettings(surface_points=256, queries=1024)
    assert len(prepare_folder(meshes, out, "chair", settings=changed).made) == 3
    assert len(prepare_folder(meshes, out, "chair", settings=changed, overwrite=True).made) == 3


def test_the_index_beside_the_meshes_gives_source_split_and_licence(meshes, tmp_path):
    (meshes / "index.csv").write_text(
        "category,shape,source,split,licence_as_stated\nchair,ball,here,test,CC0\n"
        "car,box,elsewhere,train,MIT\n"
    )
    out = tmp_path / "out"
    out.mkdir()
    write_index(out, [IndexRow("family-1", "family", "train", "MIT")])
    prepare_folder(meshes, out, "chair", settings=SMALL)
    rows = {row.name: row for row in read_index(out)}
    assert rows["ball"] == IndexRow("ball", "here", "test", "CC0")
    assert {rows["chair"].source, rows["box"].source} == {"meshes"}  # the box of the index is a car
    assert rows["family-1"].licence == "MIT"
    assert read_shape(out / "ball.npz").source == "here"


@pytest.mark.parametrize("text", ["shape,split\na,trian\n", "split\ntrain\n"])
def test_a_wrong_index_is_refused(meshes, tmp_path, text):
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(DataError, match=r"table\.csv"):
        prepare_folder(meshes, tmp_path / "out", "chair", tmp_path / "table.csv", SMALL)


def test_folders_that_cannot_be_used_are_refused(meshes, tmp_path):
    (tmp_path / "none").mkdir()
    with pytest.raises(DataError, match="known formats"):
        prepare_folder(tmp_path / "none", tmp_path / "out", "chair")
    with pytest.raises(DataError, match="missing"):
        prepare_folder(tmp_path / "missing", tmp_path / "out", "chair")
    with pytest.raises(OutputError, match="no data folder"):
        prepare_folder(meshes, meshes, "chair")
    with pytest.raises(OutputError, match="cannot make"):
        prepare_folder(meshes, meshes / "box.stl" / "out", "chair")


def test_an_interrupt_leaves_whole_files_and_an_index(meshes, tmp_path):
    def stop(done, count):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        prepare_folder(meshes, out, "chair", settings=SMALL, progress=stop)
    assert [row.name for row in read_index(out)] == ["ball"]
    assert sorted(p.name for p in out.iterdir()) == ["ball.npz", "index.csv"]
    assert len(prepare_folder(meshes, out, "chair", settings=SMALL).made) == 2
