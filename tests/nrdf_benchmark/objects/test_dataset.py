"""Folders of labelled meshes: what is read, and what is refused."""

from __future__ import annotations

import io
import json
import zipfile

import numpy as np
import pytest

from builders.labelled_boxes import LABELS, furniture, write_object, write_objects
from nrdf.errors import DataError
from nrdf_benchmark.objects.dataset import (
    ObjectEntry,
    list_objects,
    read_labels,
    read_object,
    read_objects,
)


@pytest.fixture
def root(tmp_path):
    return write_objects(tmp_path)


def test_objects_are_read_in_the_order_of_the_index_and_canonical(root):
    found = read_objects(root)
    assert [item.key for item in found] == ["chair/low", "chair/high", "stool/plain"]
    for item in found:
        extent = np.ptp(item.vertices, axis=0)
        assert extent.max() == pytest.approx(1)
        assert np.allclose(item.vertices.min(axis=0) + item.vertices.max(axis=0), 0)
        assert len(item.label) == len(item.faces)
        assert len(item.checksum) == 64
    assert {*found[0].label} == {"seat", "back", "leg"}
    assert {*found[2].label} == {"seat", "leg"}
    # The back is behind the seat, and above it.
    corners = found[0].vertices[found[0].faces]
    back, seat = (corners[found[0].label == name].mean(axis=(0, 1)) for name in ("back", "seat"))
    assert back[0] < seat[0] and back[1] > seat[1]
    assert [item.key for item in read_objects(root, ["stool"])] == ["stool/plain"]


def test_fine_labels_are_taken_where_there_are_any(root):
    path = root / "chair" / "low.npz"
    with np.load(path) as arrays:
        content = dict(arrays)
    fine = np.full(len(content["face_label"]), LABELS["mixed"])
    np.savez(path, **content, face_label_fine=fine)
    assert {*read_objects(root)[0].label} == {"mixed"}


def test_labels_stay_with_their_faces_where_faces_are_dropped(root):
    path = root / "chair" / "low.npz"
    with np.load(path) as arrays:
        vertices, faces, label = (arrays[k] for k in ("vertices", "faces", "face_label"))
    # Every face twice, and faces without area: in front, so that all numbers change.
    faces = np.concatenate([np.zeros_like(faces), faces, faces[:, [1, 2, 0]]])
    label = np.concatenate([np.zeros_like(label), label, label])
    before = read_objects(root)[0]
    np.savez(path, vertices=vertices, faces=faces, face_label=label)
    after = read_objects(root)[0]
    assert np.array_equal(after.label, before.label)
    assert np.allclose(after.vertices[after.faces], before.vertices[before.faces])


def test_labels_may_say_which_of_them_count_nowhere(root):
    labels = read_labels(root)
    assert labels.parts == ("seat", "back", "leg")
    content = {"labels": LABELS, "ignored": ["leg"], "background": []}
    (root / "labels.json").write_text(json.dumps(content))
    labels = read_labels(root)
    assert labels.parts == ("other", "seat", "back", "mixed")
    assert labels.ignored == ("leg",)


@pytest.mark.parametrize(
    "name, content, message",
    [
        ("labels.json", "{", "labels.json: expected"),
        ("labels.json", "[1]", "labels.json: expected"),
        ("labels.json", '{"labels": {"seat": "one"}}', "labels.json: expected"),
        ("labels.json", '{"labels": {}}', "0 labels"),
        ("labels.json", '{"labels": {"seat": 1, "leg": 1}}', "each a number of its own"),
        ("labels.json", '{"labels": {"seat": 1}}', "label 2 has no name; labels.json knows 1 seat"),
        ("index.csv", "category,name\n", "lists no object"),
        ("index.csv", "kind,name\nchair,low\n", "is no category and name"),
        ("index.csv", "category,name\n..,low\n", "is no category and name"),
        ("index.csv", "category,name\nchair,../low\n", "is no category and name"),
        ("index.csv", "category,name\nchair,low\nchair,low\n", "lists chair, low twice"),
        ("index.csv", "category,name\nchair,tall\n", "but there is no"),
    ],
)
def test_lists_that_make_no_sense_are_refused(root, name, content, message):
    (root / name).write_text(content)
    with pytest.raises(DataError) as caught:
        read_objects(root)
    assert message in str(caught.value)


def test_missing_lists_and_unknown_categories_are_named(root):
    with pytest.raises(DataError, match="no category 'sofa'; known: chair, stool"):
        read_objects(root, ["sofa"])
    (root / "index.csv").unlink()
    with pytest.raises(DataError, match="a folder of labelled objects has"):
        list_objects(root)
    with pytest.raises(DataError, match=r"nowhere/labels.json"):
        read_labels(root / "nowhere")


def header(shape, descr="<f4"):
    """A .npy file of a few bytes that claims an array of that shape."""
    file = io.BytesIO()
    content = {"shape": shape, "fortran_order": False, "descr": descr}
    np.lib.format.write_array_header_1_0(file, content)
    return file.getvalue() + bytes(64)


@pytest.mark.parametrize(
    "name, member, message",
    [
        ("vertices", header((10**12, 3)), "more than the file holds"),
        ("vertices", header((8, 3)), "more than the file holds"),
        ("vertices", header((4, 4)), "'vertices' is (4, 4) of float32; expected at most"),
        ("vertices", header((), "|O"), "plain numbers are needed, not object"),
        ("faces", header((8, 3), "|O"), "plain numbers are needed, not object"),
        ("faces", header((5, 3), "<f4"), "'faces' is (5, 3) of float32"),
        ("face_label", header((10**9, 10**9), "|u1"), "more than the file holds"),
        ("face_label", b"\x93NUMPY\x01\x00", "not plain NumPy arrays"),
        ("face_label", None, "no array 'face_label'"),
    ],
)
def test_arrays_are_checked_before_room_is_made_for_them(root, name, member, message):
    path = root / "chair" / "low.npz"
    with zipfile.ZipFile(path) as archive:
        members = {item: archive.read(item) for item in archive.namelist()}
    members.pop(f"{name}.npy")
    with zipfile.ZipFile(path, "w") as archive:
        for item, content in members.items():
            archive.writestr(item, content)
        if member is not None:
            archive.writestr(f"{name}.npy", member)
    with pytest.raises(DataError) as caught:
        read_object(root, ObjectEntry("chair", "low"), read_labels(root))
    assert message in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize("change", ["cut off", "no archive", "face", "nan", "labels"])
def test_damaged_objects_are_refused(root, change):
    path = root / "chair" / "low.npz"
    with np.load(path) as arrays:
        content = dict(arrays)
    if change == "face":
        content["faces"][0, 0] = 10_000
    elif change == "nan":
        content["vertices"][0] = np.nan
    elif change == "labels":
        content["face_label"] = content["face_label"][:-1]
    np.savez(path, **content)
    if change == "cut off":
        path.write_bytes(path.read_bytes()[:-100])
    elif change == "no archive":
        path.write_bytes(b"seat")
    with pytest.raises(DataError, match=r"low\.npz"):
        read_objects(root)


def test_an_object_is_named_once_with_its_folder(tmp_path):
    write_object(tmp_path, "stool", "a.b-1", furniture(0.4, 0))
    assert read_objects(tmp_path)[0].key == "stool/a.b-1"
