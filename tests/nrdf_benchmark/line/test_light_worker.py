"""Workers that only write."""

from __future__ import annotations

import json

from nrdf.serve.outbox import OBJECT
from nrdf.serve.store import ObjectRow
from nrdf_benchmark.line.light_worker import judge


def test_every_fifth_object_is_to_be_looked_at(tmp_path):
    for number, outcome in ((4, "done"), (5, "look-at")):
        row = ObjectRow(number, "a", "/in/a.csv", 1, 1, "a.csv", "running")
        assert judge(row, tmp_path / str(number))["outcome"] == outcome
        folder = tmp_path / str(number)
        assert json.loads((folder / OBJECT).read_text())["outcome"] == outcome
        assert (folder / "7.bin").stat().st_size == 50_000
