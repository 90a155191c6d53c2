"""The files of an evaluation on labelled objects."""

from __future__ import annotations

import json

import pytest

from builders.pair_results import RESULTS, SETS, pair, part
from nrdf_benchmark.objects.jobs import JobResult
from nrdf_benchmark.objects.report import Report


def job(ended=True, reasons=(), memory=10**9):
    seconds = {"transfer": 1.0, "programs": 0.5}
    return JobResult("a/1", "a/2", ended, not reasons, reasons, False, 2, seconds, memory)


def test_files_hold_the_tables_and_everything(tmp_path):
    nothing = pair("nrdf", "b/1", "b/2", part("seat", "absent", score=0.0))
    sets = {**SETS, "b": [("b/1", "b/2")]}
    report = Report([*RESULTS, nothing], sets, [job()], {"command": "nrdf eval objects"})
    paths = report.write(tmp_path)
    assert [path.name for path in paths] == ["objects.md", "objects.csv", "objects.json"]
    text = paths[0].read_text()
    assert "| `nrdf`: the category's own field, region as a mask | 0.600 | 0.000 | 0.400 |" in text
    assert "less registration" not in text  # two targets are too few
    content = json.loads(paths[2].read_text(), parse_constant=pytest.fail)
    assert content["command"] == "nrdf eval objects" and content["rows"][-1]["mean"] is None
    assert content["pairs"][0]["parts"][0]["evidence"] == [1.0, 2.0]
    assert content["jobs"][0]["seconds"] == {"transfer": 1.0, "programs": 0.5}
