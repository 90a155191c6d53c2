"""Pairs of labelled objects in scans, in pictures, and all the way to robot programs."""

from __future__ import annotations

import pytest

from builders.labelled_boxes import write_objects
from nrdf.errors import OutputError
from nrdf.field.zoo import find_weights
from nrdf.process.transfer import ProcessTransfer
from nrdf_benchmark.objects import jobs as objects_jobs
from nrdf_benchmark.objects.jobs import JobResult, describe_jobs, run_job
from nrdf_benchmark.objects.retrieval import (
    Settings,
)

LOW, HIGH, STOOL = "chair/low", "chair/high", "stool/plain"


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    root = write_objects(tmp_path_factory.mktemp("objects"))
    return Settings(root, find_weights("chair"), 1500)


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


def test_jobs_say_how_many_ended_and_what_failed():
    first, *failed = describe_jobs([job(), job(reasons=("leg: absent",)), job(False, ("x", "y"))])
    assert "2 of 3 pairs ended well, 1 with a tool path on every part" in first
    assert "1.5 s a pair" in first and "1.00 GB" in first
    assert failed == ["a/1 to a/2: y"]
    assert "GB" not in describe_jobs([job(memory=None)])[0] and describe_jobs([]) == []


def job(ended=True, reasons=(), memory=10**9):
    seconds = {"transfer": 1.0, "programs": 0.5}
    return JobResult("a/1", "a/2", ended, not reasons, reasons, False, 2, seconds, memory)
