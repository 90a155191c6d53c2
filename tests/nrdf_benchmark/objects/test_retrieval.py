"""Parts of labelled objects found by every kind of method, whole and in scans."""

from __future__ import annotations

from pathlib import Path

import pytest

from builders.labelled_boxes import IKEA, write_objects
from nrdf.field.zoo import find_weights
from nrdf.regions.model import load_model
from nrdf_benchmark.methods.registry import MethodSpec, find_methods
from nrdf_benchmark.objects.retrieval import Settings, shared_retrieval
from nrdf_benchmark.objects.table import rows_of
from nrdf_benchmark.presence import examples_of_objects

LOW, HIGH, STOOL = "chair/low", "chair/high", "stool/plain"


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return Settings(root, find_weights("chair"), 1500)


def test_parts_are_found_in_scans_by_every_method_in_the_pose_that_was_found(settings):
    retrieval, specs = shared_retrieval(settings), find_methods(["nrdf", "registration"], "chair")
    results = [retrieval.run(spec, 3, LOW, HIGH) for spec in specs]
    assert results[0].pose == results[1].pose
    assert results[0].pose.degrees < 5 and results[0].pose.scale < 0.05
    for result in results:
        assert (
            result.parts[0].true == (retrieval.target_cloud(HIGH, 3).labelled.label == "seat").sum()
        )
        for part in result.parts:
            assert part.state == "there" and part.iou > 0.5, (result.method, part)


def test_a_model_that_seeks_sees_the_target_by_its_own_embedding(settings):
    """Not by that of the model which the objects were encoded and aligned with."""
    retrieval, general = shared_retrieval(settings), load_model("general")
    regions, reference = retrieval.regions(LOW), retrieval.whole_cloud(LOW).cloud
    cloud = retrieval.whole_cloud(HIGH).cloud
    matches = general.set_reference(reference).retrieve_all(regions, cloud, drop_absent=False)
    for example in examples_of_objects(retrieval, LOW, HIGH, (0,), general):
        evidence = matches[example.region].presence.evidence
        assert example.evidence == pytest.approx(evidence, abs=1e-6)


def by_part(result):
    return {part.part: part for part in result.parts}


def test_parts_are_found_and_scored_by_every_kind_of_method(settings):
    for spec in find_methods(["nrdf", "registration", "box-mask"], "chair"):
        result = shared_retrieval(settings).run(spec, 0, "chair/low", "chair/high")
        parts = by_part(result)
        assert set(parts) == {"seat", "back", "leg"} and result.pose is None
        for part in parts.values():
            assert part.state == "there" and part.iou > 0.6, (spec.name, part)
            assert (part.score is not None) == (spec.name == "nrdf")
        lacking = by_part(shared_retrieval(settings).run(spec, 0, "chair/low", "stool/plain"))
        assert (lacking["back"].state, lacking["back"].iou) == ("absent", None)
    assert "back" not in by_part(
        shared_retrieval(settings).run(spec, 0, "stool/plain", "chair/low")
    )


def test_what_absence_was_told_by_is_kept(settings):
    (spec,) = find_methods(["nrdf"], "chair")
    back = by_part(shared_retrieval(settings).run(spec, 0, "chair/high", "stool/plain"))["back"]
    assert back.reason == "absent" and back.confidence > 0.5 and len(back.evidence) >= 2
    assert (back.found, back.score) == (0, 0)


@pytest.mark.skipif(not IKEA.is_dir(), reason=f"no labelled furniture in {IKEA}")
def test_real_furniture():
    settings = Settings(Path(IKEA), find_weights("chair"))
    pairs = [("chair/agam", "chair/mammut_1"), ("chair/sigurd", "chair/sundvik")]
    results = [
        shared_retrieval(settings).run(MethodSpec("registration"), 0, *pair) for pair in pairs
    ]
    (row,) = rows_of(results, {"chair+stool": pairs})
    assert row.iou["seat"][0] > 0.6 and row.iou["back"][0] > 0.9 and row.mean > 0.6
    assert row.told is None
