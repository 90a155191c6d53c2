"""Pictures of the worst pairs."""

from __future__ import annotations

import pytest

from builders.labelled_boxes import write_objects
from builders.pair_results import pair, part
from nrdf.field.zoo import find_weights
from nrdf_benchmark.methods.registry import find_methods
from nrdf_benchmark.objects.picture import draw_worst, worst_pairs
from nrdf_benchmark.objects.retrieval import (
    Settings,
    shared_retrieval,
)

LOW, HIGH, STOOL = "chair/low", "chair/high", "stool/plain"


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return Settings(root, find_weights("chair"), 1500)


def test_pictures_of_the_worst_pairs(settings, tmp_path):
    retrieval, (spec,) = shared_retrieval(settings), find_methods(["box-mask"], "chair")
    results = [retrieval.run(spec, 0, LOW, target) for target in (HIGH, STOOL)]
    paths = draw_worst(retrieval, spec, results, tmp_path / "worst")
    names = {path.name.split("-", 1)[1] for path in paths}
    assert names == {"chair_low-to-chair_high.png", "chair_low-to-stool_plain.png"}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_worst_pairs_come_first_and_those_without_parts_not_at_all():
    lost = [part("seat", iou=0.0), part("leg", iou=0.0)]
    one, two = pair("nrdf", "a/1", "a/4", lost[0]), pair("nrdf", "a/1", "a/5", *lost)
    empty = pair("nrdf", "a/1", "a/3", part("seat", "absent"))
    good = pair("nrdf", "a/1", "a/6", part("seat", iou=0.9))
    assert worst_pairs([good, one, empty, two]) == [two, one, good]
    assert worst_pairs([good, one, empty, two], 1) == [two]
