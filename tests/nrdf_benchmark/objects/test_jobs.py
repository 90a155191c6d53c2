"""Pairs of labelled objects in scans, in pictures, and all the way to robot programs."""

from __future__ import annotations

import pytest

from builders.labelled_boxes import write_objects
from nrdf.errors import OutputError
from nrdf.field.zoo import find_weights
from nrdf.process.transfer import ProcessTransfer
from nrdf_benchmark.methods.registry import find_methods
from nrdf_benchmark.objects import jobs as objects_jobs
from nrdf_benchmark.objects.jobs import run_job
from nrdf_benchmark.objects.picture import draw_worst
from nrdf_benchmark.objects.retrieval import Settings, shared_retrieval

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


def test_pictures_of_the_worst_pairs(settings, tmp_path):
    retrieval, (spec,) = shared_retrieval(settings), find_methods(["box-mask"], "chair")
    results = [retrieval.run(spec, 0, LOW, target) for target in (HIGH, STOOL)]
    paths = draw_worst(retrieval, spec, results, tmp_path / "worst")
    names = {path.name.split("-", 1)[1] for path in paths}
    assert names == {"chair_low-to-chair_high.png", "chair_low-to-stool_plain.png"}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in paths)


def test_a_pair_goes_from_a_file_to_robot_programs(settings, monkeypatch):
    job = run_job(settings, LOW, HIGH)
    assert job.ended and job.complete and not job.crashed, job
    assert job.reasons == () and job.paths == 3
    assert list(job.seconds) == ["reference", "target file", "transfer", "job folder", "programs"]
    assert job.memory_bytes is None or 1e8 < job.memory_bytes < 4e9


def test_what_fails_is_told_with_its_step(settings, monkeypatch):
    for error, crashed, said in (
        (OutputError("the disk is full"), False, "target file: the disk is full"),
        (ValueError("bad"), True, "target file: ValueError: bad"),
    ):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(objects_jobs, "read_cloud", fail)
        job = run_job(settings, LOW, HIGH)
        assert (job.ended, job.complete, job.crashed) == (False, False, crashed)
        assert job.reasons == (said,) and job.paths == 0


def test_a_pair_without_a_tool_path_has_not_ended_well(settings, monkeypatch):
    transfer = ProcessTransfer.transfer

    def nothing(self, cloud, unit):
        return transfer(self, cloud, unit, min_confidence=1.0)

    monkeypatch.setattr(ProcessTransfer, "transfer", nothing)
    job = run_job(settings, LOW, HIGH)
    assert not job.ended and not job.crashed
    assert job.reasons[-1].startswith("programs: no tool path: seat: ")
