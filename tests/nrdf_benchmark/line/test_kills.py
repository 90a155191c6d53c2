"""What `kill -9` costs, counted."""

from __future__ import annotations

import json

from nrdf_benchmark.line.kills import check_outbox


def test_lost_doubled_and_half_written_objects_are_counted(tmp_path):
    inbox, out = tmp_path / "inbox", tmp_path / "out"
    inbox.mkdir()
    for name in ("a", "b", "c"):
        (inbox / name).write_text("x")
    for outcome, folder, said in (
        ("done", "a", {"source": "/in/a", "outcome": "done"}),
        ("done", "a-2", {"source": "/in/a", "outcome": "done"}),
        ("look-at", "b", {"source": "/in/b", "outcome": "done"}),
        ("refused", "x", None),
    ):
        (out / outcome / folder).mkdir(parents=True)
        if said:
            (out / outcome / folder / "object.json").write_text(json.dumps(said))
    assert check_outbox(inbox, out) == {"objects": 3, "lost": 1, "twice": 1, "halves": 2}
