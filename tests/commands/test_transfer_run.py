"""What all targets of one transfer share, and what is said of each."""

from __future__ import annotations

import pytest

from nrdf.commands.transfer_run import TransferRun, show_transfer
from nrdf.errors import OutputError, ProcessError
from nrdf.process.limits import Limits
from nrdf.serve.object_transfer import ObjectTransfer


@pytest.fixture
def run(tmp_path):
    return TransferRun(ObjectTransfer(tmp_path / "no.yaml"), (), Limits())


def test_a_full_folder_is_refused_before_the_knowledge_is_read(run, tmp_path):
    (tmp_path / "job").mkdir()
    (tmp_path / "job" / "mine.txt").write_text("mine")
    with pytest.raises(OutputError, match="not empty"):
        run.transfer(tmp_path / "new.ply", tmp_path / "job")
    with pytest.raises(ProcessError, match=r"no knowledge file .*no\.yaml"):
        run.transfer(tmp_path / "new.ply", tmp_path / "other")
    assert run.reports == {} and not (tmp_path / "other").exists()


def test_the_table_has_a_row_a_path_and_warnings_follow(capsys):
    path = {"region": "seat", "process": "sand", "planned": False}
    report = {
        "paths": [path, {**path, "region": "back"}],
        "regions": {"seat": {"confidence": 0.5}, "back": {"confidence": 0.25}},
        "warnings": ["the scan is thin"],
    }
    show_transfer(report)
    said = capsys.readouterr()
    rows = [line.split() for line in said.out.splitlines() if "sand" in line]
    assert [row[:4] for row in rows] == [
        ["seat", "sand", "0.50", "–"],
        ["back", "sand", "0.25", "–"],
    ]
    assert said.err == "the scan is thin\n"
