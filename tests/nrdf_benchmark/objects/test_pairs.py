"""Labels of points, which parts are there, and how a found part is scored."""

from __future__ import annotations

import numpy as np
import pytest

from builders.labelled_boxes import furniture, write_object, write_objects
from nrdf.errors import DataError
from nrdf.geometry.similarity import Similarity
from nrdf.io.cloud import PointCloud
from nrdf_benchmark.objects.dataset import Labels, read_labels, read_objects
from nrdf_benchmark.objects.evaluate import pairs_of
from nrdf_benchmark.objects.pairs import (
    group_categories,
    part_iou,
    parts_of,
    state_of,
    truth_of,
)
from nrdf_benchmark.objects.sampling import FLOOR, LabelledCloud, sample_object, scan_object

LABELS = Labels({0: "other", 1: "seat", 2: "back", 3: "leg", 4: "mixed"})


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return {item.key: item for item in read_objects(root)}


def labelled(*names_and_counts):
    label = np.concatenate([np.full(count, name) for name, count in names_and_counts])
    points = np.zeros((len(label), 3))
    return LabelledCloud(PointCloud(points), label, Similarity(np.eye(3), np.zeros(3), 1.0))


def test_points_of_the_skin_carry_the_label_of_their_face(objects):
    mesh = objects["chair/low"]
    seen = sample_object(mesh, 2000)
    again = sample_object(mesh, 2000)
    assert np.array_equal(seen.cloud.points, again.cloud.points)
    corners = mesh.vertices[mesh.faces]
    for name in ("seat", "back", "leg"):
        own = corners[mesh.label == name].reshape(-1, 3)
        points = seen.cloud.points[seen.label == name]
        assert len(points) > 100
        assert (points >= own.min(axis=0) - 1e-9).all() and (points <= own.max(axis=0) + 1e-9).all()


def test_normals_are_estimated_or_the_meshes_own(objects):
    mesh = objects["chair/low"]
    given, estimated = (sample_object(mesh, 1000, kind) for kind in ("given", "estimated"))
    assert np.array_equal(given.cloud.points, estimated.cloud.points)
    own = np.abs(given.cloud.normals)
    assert np.allclose(np.sort(own, axis=1)[:, :2], 0, atol=1e-9)
    agree = (given.cloud.normals * estimated.cloud.normals).sum(axis=1)
    assert (agree > 0.9).mean() > 0.7 and not np.allclose(agree, 1)


def test_scans_know_their_floor_and_the_pose_that_they_were_taken_in(objects):
    mesh = objects["chair/high"]
    seen = scan_object(mesh, 1)
    assert seen.cloud.normals is None and len(seen.cloud.sensors) == 1
    floor = seen.cloud.points[seen.label == FLOOR]
    assert len(floor) > 100 and np.ptp(floor[:, 2]) < 0.02 * seen.pose.scale
    points = seen.pose.to_canonical(seen.cloud.points)
    for name in ("seat", "back"):
        own = mesh.vertices[mesh.faces[mesh.label == name]].reshape(-1, 3)
        inside = (points >= own.min(axis=0) - 0.02) & (points <= own.max(axis=0) + 0.02)
        assert inside.all(axis=1)[seen.label == name].mean() > 0.99
    assert len(scan_object(mesh, 3).cloud.sensors) == 3


def test_parts_are_labels_with_enough_points():
    cloud = labelled(("seat", 7000), ("leg", 41), ("back", 40), ("mixed", 900), ("other", 211))
    assert len(cloud.label) == 8192
    assert set(parts_of(LABELS, cloud)) == {"seat", "leg"}
    few = labelled(("seat", 900), ("leg", 20), ("back", 19))
    assert set(parts_of(LABELS, few)) == {"seat", "leg"}


def test_a_part_is_lacked_only_where_nothing_could_be_it(objects, tmp_path):
    stool = objects["stool/plain"]
    cloud = sample_object(stool, 1000)
    truth = truth_of(LABELS, stool, cloud)
    assert truth.lacked == ("back",) and truth.parts == ("seat", "leg")
    parts = [("mixed" if part == "leg" else part, mesh) for part, mesh in furniture(0.45, 0)]
    write_object(tmp_path, "stool", "mixed", parts)
    mixed = read_objects(tmp_path)[0]
    truth = truth_of(read_labels(tmp_path), mixed, sample_object(mixed, 1000))
    assert truth.lacked == () and truth.parts == ("seat",)


def test_state_depends_on_what_was_seen(objects):
    stool = objects["stool/plain"]
    truth = truth_of(LABELS, stool, sample_object(stool, 1000))
    share = truth.share["leg"]
    due = round(1000 * share)
    for count, state in ((due, "there"), (round(0.1 * due), ""), (round(0.01 * due), "hidden")):
        seen = labelled(("leg", count), ("seat", 1000 - count), (FLOOR, 5000))
        assert state_of("leg", truth, seen) == state
    assert state_of("back", truth, seen) == "absent"
    assert state_of("arm", truth, seen) == ""


def test_iou_leaves_points_out_that_count_nowhere():
    seen = labelled(("seat", 100), ("leg", 100), ("mixed", 100), ("other", 100))
    assert part_iou(np.arange(100), "seat", LABELS, seen) == 1
    assert part_iou(np.arange(50, 150), "seat", LABELS, seen) == pytest.approx(50 / 150)
    assert part_iou(np.r_[0:100, 200:300], "seat", LABELS, seen) == 1
    assert part_iou(np.r_[0:100, 300:400], "seat", LABELS, seen) == 0.5
    assert part_iou(np.arange(0), "seat", LABELS, seen) == 0


def test_groups_and_pairs(objects):
    categories = ["chair", "stool", "bench"]
    assert group_categories(categories) == {
        "chair+stool": ("chair", "stool"), "bench": ("bench",),
    }  # fmt: skip
    assert group_categories(["stool"]) == {"stool": ("stool",)}
    assert group_categories(categories, ()) == {name: (name,) for name in categories}
    with pytest.raises(DataError, match="each category can be in one of them only"):
        group_categories(categories, ("chair+stool", "stool+bench"))
    pairs = pairs_of(list(objects.values()), ["chair", "stool"])
    assert len(pairs) == 6 and ("chair/low", "stool/plain") in pairs
    assert pairs_of(list(objects.values()), ["stool"]) == []
