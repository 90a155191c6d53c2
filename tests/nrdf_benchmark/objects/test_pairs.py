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
    draw_pairs,
    group_categories,
    part_iou,
    parts_of,
    state_of,
    truth_of,
)
from nrdf_benchmark.objects.sampling import FLOOR, LabelledCloud, sample_object

LABELS = Labels({0: "other", 1: "seat", 2: "back", 3: "leg", 4: "mixed"})


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return {item.key: item for item in read_objects(root)}


def labelled(*names_and_counts):
    label = np.concatenate([np.full(count, name) for name, count in names_and_counts])
    points = np.zeros((len(label), 3))
    return LabelledCloud(PointCloud(points), label, Similarity(np.eye(3), np.zeros(3), 1.0))


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


def test_the_same_pairs_are_drawn_every_time():
    pairs = [(f"a/{i}", f"a/{i + 1}") for i in range(50)]
    assert (
        draw_pairs(pairs, 5)
        == draw_pairs(pairs, 5)
        == sorted(draw_pairs(pairs, 5), key=pairs.index)
    )
    assert len({*draw_pairs(pairs, 5)}) == 5 and draw_pairs(pairs, 0) == []
    assert draw_pairs(pairs, 100) == pairs
