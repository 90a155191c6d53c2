"""Shapes of oriented boxes: occupancy, surface, files."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from nrdf.errors import DataError, OutputError
from nrdf.shapes import boxes as module
from nrdf.shapes.boxes import BoxUnion, is_usable_chair, prepare_boxes, read_boxes
from nrdf.shapes.dataset import IndexRow, read_index, read_shape, shape_paths, write_index

EPS = 1e-5


def random_boxes(seed: int, count: int = 5):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    return rng.uniform(-1, 1, (count, 3)), axes, rng.uniform(0.2, 1.5, (count, 3))


def inside(center, axes, size, points):
    """Occupancy of one point and one box at a time."""
    found = np.zeros(len(points), bool)
    for i, point in enumerate(points):
        for c, rows, s in zip(center, axes, size, strict=True):
            found[i] |= all(abs(rows[k] @ (point - c)) < s[k] / 2 for k in range(3))
    return found


@pytest.fixture(params=range(3))
def solid(request):
    return BoxUnion(*random_boxes(request.param))


def test_occupancy_is_that_of_the_single_boxes(solid):
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (300, 3))
    expected = inside(solid.center, solid.axes, 2 * solid.half, points)
    assert 10 < expected.sum() < 290
    np.testing.assert_array_equal(solid.occupancy(points), expected)


def test_boxes_become_canonical():
    center, axes, size = random_boxes(0)
    solid = BoxUnion(100 * center + 7, axes, 100 * size)
    near = BoxUnion(center, axes, size)
    np.testing.assert_allclose(solid.center, near.center, atol=1e-9)
    np.testing.assert_allclose(solid.half, near.half, atol=1e-9)
    corners = np.concatenate(
        [
            trimesh.creation.box(2 * half).vertices @ rows + c
            for c, rows, half in zip(solid.center, solid.axes, solid.half, strict=True)
        ]
    )
    low, high = corners.min(0), corners.max(0)
    np.testing.assert_allclose(low + high, 0, atol=1e-9)
    assert (high - low).max() == pytest.approx(1)


def test_the_surface_parts_inside_from_outside(solid):
    points, normals = solid.sample_surface(1500, np.random.default_rng(0))
    assert points.shape == normals.shape == (1500, 3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-9)
    assert solid.occupancy(points - EPS * normals).all()
    assert not solid.occupancy(points + EPS * normals).any()


def test_what_another_box_covers_is_left_out():
    """A small box half sunk into a big one: half its sides and none of its base are seen."""
    big, small = np.array([2.0, 2, 2]), np.array([0.5, 1.0, 0.5])
    solid = BoxUnion([[0, 0, 0], [0, 1, 0]], [np.eye(3)] * 2, [big, small])
    points, _ = solid.sample_surface(20_000, np.random.default_rng(0))
    top = solid.center[0, 1] + solid.half[0, 1]
    mast = (points[:, 1] > top + EPS).mean()
    sides, lid, covered = 4 * 0.5 * 0.5, 0.25, 0.25
    assert mast == pytest.approx((sides + lid) / (24 - covered + sides + lid), abs=0.005)
    foot = (np.abs(points[:, 1] - top) < EPS) & (np.abs(points[:, [0, 2]]) < 0.24 / 2.5).all(1)
    assert not foot.any()


def test_only_chairs_with_slim_legs_are_usable():
    size = np.full((5, 3), 0.5)
    size[2:, 0] = 0.05
    label = np.array([0, 1, 2, 2, 2])
    assert is_usable_chair(size, label)
    assert not is_usable_chair(size, np.array([1, 1, 2, 2, 2]))  # no back
    assert not is_usable_chair(size, np.array([0, 0, 2, 2, 2]))  # no seat
    assert not is_usable_chair(size, np.array([0, 1, 2, 2, 3]))  # two legs
    size[4] = 0.5
    assert not is_usable_chair(size, label)  # a base in one box


def chair(rng):
    """Seat, back, four legs: center, size, label."""
    w, h = rng.uniform(0.4, 0.6, 2)
    legs = [(x * w / 2, -h / 2, z * w / 2) for x in (-1, 1) for z in (-1, 1)]
    center = [(0, 0, 0), (-w / 2, h / 2, 0), *legs]
    size = [(w, 0.06, w), (0.05, h, w), *[(0.05, h, 0.05)] * 4]
    return np.array(center), np.array(size), np.array([1, 0, 2, 2, 2, 2])


@pytest.fixture
def file(tmp_path):
    """7 chairs and one thing that is none."""
    rng = np.random.default_rng(0)
    parts = [chair(rng) for _ in range(7)]
    parts.insert(3, (np.zeros((1, 3)), np.ones((1, 3)), np.array([1])))
    path = tmp_path / "boxes.npz"
    np.savez(
        path,
        center=np.concatenate([p[0] for p in parts]),
        axes=np.concatenate([np.tile(np.eye(3), (len(p[0]), 1, 1)) for p in parts]),
        size=np.concatenate([p[1] for p in parts]),
        label=np.concatenate([p[2] for p in parts]),
        offset=np.cumsum([0, *[len(p[0]) for p in parts]]),
    )
    return path


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(module, "SURFACE_POINTS", 400)
    monkeypatch.setattr(module, "QUERIES", 300)


def test_files_hold_what_the_boxes_say(file, tmp_path):
    told = []
    made = prepare_boxes(
        file, tmp_path / "out", "chair", 3, licence="MIT", progress=lambda *a: told.append(a)
    )
    assert made == 3 and told == [(1, 3), (2, 3), (3, 3)]
    rows = read_index(tmp_path / "out")
    assert [(r.source, r.split, r.licence) for r in rows] == [("boxes", "train", "MIT")] * 3
    boxes = read_boxes(file)
    for row in rows:
        shape = read_shape(tmp_path / "out" / f"{row.name}.npz")
        assert (shape.category, shape.source) == ("chair", "boxes")
        index = int(row.name.removeprefix("boxes-"))
        start, end = boxes["offset"][index : index + 2]
        solid = BoxUnion(*(boxes[key][start:end] for key in ("center", "axes", "size")))
        assert shape.surface_points.shape == (400, 3)
        np.testing.assert_array_equal(
            shape.query_occupancies, solid.occupancy(shape.query_points.astype(float))
        )
        assert 0.05 < shape.query_occupancies.mean() < 0.95


def test_unusable_objects_are_left_out_and_a_larger_run_goes_on(file, tmp_path):
    out = tmp_path / "out"
    prepare_boxes(file, out, "chair", 3)
    before = {path: path.stat().st_mtime_ns for path in shape_paths(out)}
    assert prepare_boxes(file, out, "chair", 100) == 7
    assert {row.name for row in read_index(out)} == {f"boxes-{i:05d}" for i in range(8) if i != 3}
    for path, time in before.items():
        assert path.stat().st_mtime_ns == time


def test_shapes_from_elsewhere_stay_in_the_index(file, tmp_path):
    other = IndexRow("mine", "scanner", "val", "CC0")
    write_index(tmp_path, [other])
    prepare_boxes(file, tmp_path, "chair", 1)
    assert other in read_index(tmp_path) and len(read_index(tmp_path)) == 2


def change(path, **arrays):
    with np.load(path) as before:
        np.savez(path, **{**dict(before), **arrays})


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"offset": np.array([0, 6, 40])}, "offset ends at 40, not at the last of 43 boxes"),
        ({"offset": np.array([0, 20, 10, 43])}, "offset must rise from 0"),
        ({"offset": np.array([], int)}, "offset must rise from 0"),
        ({"size": np.ones((5, 3))}, r"size is \(5, 3\), expected \(43, 3\)"),
        ({"axes": np.ones((43, 3))}, r"axes is \(43, 3\), expected \(43, 3, 3\)"),
        ({"label": np.zeros(43, int)}, "none of the 8 objects in .* is usable"),
    ],
)
def test_a_file_that_makes_no_sense_is_refused(file, tmp_path, arrays, message):
    change(file, **arrays)
    with pytest.raises(DataError, match=message):
        prepare_boxes(file, tmp_path / "out", "chair", 3)
    assert not (tmp_path / "out").exists()


def test_what_is_no_file_of_boxes_is_refused(file, tmp_path):
    with pytest.raises(DataError, match=r"no file .*nothing\.npz; expected \.npz with center"):
        read_boxes(tmp_path / "nothing.npz")
    np.savez(tmp_path / "half.npz", center=np.zeros((1, 3)), offset=np.array([0, 1]))
    with pytest.raises(DataError, match="it has no axes, size, label"):
        read_boxes(tmp_path / "half.npz")
    np.save(tmp_path / "one.npy", np.zeros(3))
    content = file.read_bytes()
    for number, start in enumerate([b"", b"text", content[: len(content) // 2]]):
        (tmp_path / f"{number}.npz").write_bytes(start)
    for name in ("0.npz", "1.npz", "2.npz", "one.npy"):
        with pytest.raises(DataError, match=f"{name} is no file of boxes"):
            read_boxes(tmp_path / name)


def test_a_count_or_a_folder_that_cannot_be_is_refused(file, tmp_path):
    with pytest.raises(DataError, match="0 shapes asked for"):
        prepare_boxes(file, tmp_path / "out", "chair", 0)
    with pytest.raises(OutputError, match=r"cannot make .*boxes"):
        prepare_boxes(file, file, "chair", 1)


def test_a_box_within_a_box_has_no_surface():
    hidden = BoxUnion([[0, 0, 0]] * 2, [np.eye(3)] * 2, [[1, 1, 1], [1.1, 1.1, 1.1]])
    points, _ = hidden.sample_surface(500, np.random.default_rng(0))
    np.testing.assert_allclose(np.abs(points).max(axis=1), 0.5)
