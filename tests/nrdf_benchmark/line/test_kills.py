"""What `kill -9` costs, counted."""

from __future__ import annotations

import json

from nrdf_benchmark.line import kills
from nrdf_benchmark.line.kills import check_outbox, kill_runs, published
from nrdf_benchmark.line.objects import write_light_cell


def test_lost_doubled_and_half_written_objects_are_counted(tmp_path):
    out = tmp_path / "out"
    for outcome, folder, said in (
        ("done", "a", {"source": "/in/a", "outcome": "done"}),
        ("done", "a-2", {"source": "/in/a", "outcome": "done"}),
        ("look-at", "b", {"source": "/in/b", "outcome": "done"}),
        ("refused", "x", None),
    ):
        (out / outcome / folder).mkdir(parents=True)
        if said:
            (out / outcome / folder / "object.json").write_text(json.dumps(said))
    assert check_outbox(["a", "b", "c"], out) == {"objects": 3, "lost": 1, "twice": 1, "halves": 2}
    assert published(out) == 4


def test_a_run_that_is_killed_loses_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(kills, "_OBJECTS_A_KILL", 5)
    monkeypatch.setattr(kills, "_LONGEST_S", 0.3)
    found = kill_runs(write_light_cell(tmp_path), tmp_path / "kills", 1, 0)
    assert found == {"kills": 1, "objects": 5, "lost": 0, "twice": 0, "halves": 0}
