"""The task of one object among many, and what need not be done again."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from nrdf.errors import CloudError
from nrdf.process.limits import Limits
from nrdf.serve.many import TransferTask, failed, made_from, transfer_one
from nrdf.serve.object_transfer import ObjectTransfer
from nrdf.serve.scan_input import ScanOptions

REPORT = {"limits": {"not_met": []}, "strict_warnings": ["odd"], "paths": [],
          "total": {"paths": 2, "skipped": 0, "cycle_time_s": 1.0}}  # fmt: skip


@pytest.fixture
def task(tmp_path, monkeypatch):
    made = []
    (tmp_path / "k.yaml").write_text("knowledge")
    (tmp_path / "a.ply").write_text("cloud")

    def write(self, folder, target, result, scan, limits, command, more):
        made.append(target.name)
        report = {**REPORT, **more, "files": ["report.json"]}
        (folder / "report.json").write_text(json.dumps(report))
        return report

    monkeypatch.setattr(ObjectTransfer, "transfer", lambda self, target: (None, None))
    monkeypatch.setattr(ObjectTransfer, "write", write)
    given = TransferTask(
        tmp_path / "k.yaml", None, "cpu", ScanOptions(None), None, Limits(), False, False, "nrdf"
    )
    return given, made


def test_a_job_that_was_made_from_the_same_is_not_made_again(task, tmp_path):
    given, made = task
    target, folder = tmp_path / "a.ply", tmp_path / "out"
    assert transfer_one(given, (target, folder)).exit_code == 0
    again = transfer_one(given, (target, folder))
    assert again.known and again.total == REPORT["total"] and made == ["a.ply"]
    assert transfer_one(replace(given, strict=True), (target, folder)).reasons == ("odd",)
    target.write_text("changed")
    refused = transfer_one(given, (target, folder))
    assert refused.exit_code == 2 and "not empty" in refused.reasons[0]
    assert transfer_one(replace(given, overwrite=True), (target, folder)).exit_code == 0
    assert made == ["a.ply", "a.ply"]
    (folder / "report.json").write_text("{")
    assert transfer_one(given, (target, folder)).exit_code == 2


def test_what_goes_wrong_is_that_objects_own(task, tmp_path, monkeypatch):
    given, _ = task
    assert transfer_one(given, (tmp_path / "none.ply", tmp_path / "x")).exit_code == 2

    def fails(self, target):
        raise CloudError("flat")

    monkeypatch.setattr(ObjectTransfer, "transfer", fails)
    outcome = transfer_one(given, (tmp_path / "a.ply", tmp_path / "x"))
    assert outcome.reasons == ("flat",) and not (tmp_path / "x").exists()
    limits = made_from(replace(given, limits=Limits(min_coverage=0.5)), tmp_path / "a.ply")
    assert limits != made_from(given, tmp_path / "a.ply")


def test_an_error_that_nobody_foresaw_is_raised(tmp_path):
    pair = (tmp_path / "a", tmp_path / "b")
    assert failed(pair, OSError(28, "No space left")).reasons == (
        "the system refused: No space left",
    )
    with pytest.raises(ZeroDivisionError):
        failed(pair, ZeroDivisionError())
