"""What a worker makes of one object."""

from __future__ import annotations

import json

import pytest

from builders.cells import cell_of
from builders.export_jobs import small_job
from nrdf.bundled import KNOWLEDGE
from nrdf.cell.rules import read_choices
from nrdf.errors import CloudError, OutputError
from nrdf.serve.object_transfer import ObjectTransfer
from nrdf.serve.outbox import OBJECT
from nrdf.serve.store import ObjectRow
from nrdf.serve.work import ObjectWork
from nrdf.toolpath.file import write_toolpaths

REPORT = {
    "category": "plate",
    "regions": {"top": {"found": True, "confidence": 0.8}},
    "paths": [{"region": "top", "planned": True, "metrics": {"coverage": 0.97}}],
    "total": {"paths": 1, "skipped": 0, "cycle_time_s": 12.34},
    "warnings": [],
    "strict_warnings": [],
    "limits": {"not_met": []},
}


@pytest.fixture
def judged(tmp_path, monkeypatch):
    """Judges a file with a transfer that ends with a report, or an error."""

    def judge(outcome=REPORT, wrong_stat=False, **changes):
        file = tmp_path / "new.ply"
        file.write_text("ply")
        stat = file.stat()

        def transfer(self, target):
            if isinstance(outcome, Exception):
                raise outcome
            return None, None

        def write(self, work, *_):
            write_toolpaths(work, small_job())
            return outcome

        monkeypatch.setattr(ObjectTransfer, "transfer", transfer)
        monkeypatch.setattr(ObjectTransfer, "write", write)
        cell = cell_of(knowledge=[{"file": str(KNOWLEDGE)}], **changes)
        work = ObjectWork(cell, tmp_path, read_choices(cell, tmp_path))
        size = stat.st_size + wrong_stat
        row = ObjectRow(1, "new", str(file), size, stat.st_mtime_ns, "new.ply", "running")
        place = tmp_path / f"work-{len(list(tmp_path.iterdir()))}"
        return work.judge(row, place), place

    return judge


def test_a_good_job_is_done_with_its_programs(judged):
    said, place = judged(programs={"formats": ["json", "urscript"]})
    assert (said.outcome, said.reason, said.again) == ("done", "", False)
    assert said.figures["confidence"] == 0.8 and said.figures["cycle_time_s"] == 12.3
    assert (place / "programs" / "urscript" / "nrdf_plate.script").is_file()
    assert json.loads((place / OBJECT).read_text())["outcome"] == "done"


def test_doubts_and_the_cells_limits_send_a_job_where_the_cell_says(judged):
    doubtful = {**REPORT, "strict_warnings": ["region 'top': doubtful"]}
    said, _ = judged(doubtful)
    assert (said.outcome, said.reason) == ("look-at", "region 'top': doubtful")
    assert judged(doubtful, limits={"strict": False})[0].outcome == "done"
    assert judged(doubtful, limits={"otherwise": "refused"})[0].outcome == "refused"
    said, place = judged(robot={"max_force_n": 1})
    assert said.outcome == "look-at" and "not within the cell's limits" in said.reason
    assert not (place / "programs").exists()
    nothing = {**REPORT, "paths": [], "total": {"paths": 0, "skipped": 1, "cycle_time_s": 0.0}}
    assert "no tool path could be planned" in judged(nothing)[0].reason


def test_bad_input_is_refused_and_a_full_disk_is_nobodys_fault(judged):
    said, place = judged(CloudError("flat"))
    assert (said.outcome, said.reason) == ("refused", "flat") and (place / OBJECT).is_file()
    said, _ = judged(wrong_stat=True)
    assert said.outcome == "refused" and "has changed since it arrived" in said.reason
    assert judged(OutputError("disk full"))[0].again and judged(OSError(28, "no space"))[0].again
    said, place = judged(ZeroDivisionError("ours"))
    assert said.outcome == "refused" and "an error in nrdf: ZeroDivisionError" in said.reason
    assert "Traceback" in (place / "reason.txt").read_text()
