"""One object's transfer: what speaks against it."""

from __future__ import annotations

import pytest

from nrdf.errors import ProcessError
from nrdf.serve.object_transfer import ObjectTransfer, doubts, reasons_for_nothing

REPORT = {
    "limits": {"not_met": ["the coverage is low"]},
    "strict_warnings": ["region 'seat': doubtful"],
    "paths": [
        {"region": "seat", "reason": "absent"},
        {"region": "seat", "reason": "absent"},
        {"region": "legs", "reason": "too small"},
    ],
}


def test_doubts_are_limits_and_where_strict_warnings():
    assert doubts(REPORT, False) == ["the coverage is low"]
    assert doubts(REPORT, True) == ["the coverage is low", "region 'seat': doubtful"]
    assert reasons_for_nothing(REPORT) == ["region 'seat': absent", "region 'legs': too small"]


def test_knowledge_is_read_when_it_is_needed(tmp_path):
    objects = ObjectTransfer(tmp_path / "no.yaml")
    with pytest.raises(ProcessError, match="no knowledge file"):
        objects.transfer(tmp_path / "new.ply")
