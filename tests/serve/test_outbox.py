"""Folders of objects: whole, once, where their outcome says."""

from __future__ import annotations

import json

import pytest

from nrdf.errors import OutputError
from nrdf.serve.outbox import OBJECT, REASON, Outbox, in_one_line, write_object
from nrdf.serve.store import ObjectRow

ROW = ObjectRow(7, "chair", "/in/chair.ply", 10, 99, "chair.ply", "running")


@pytest.fixture
def outbox(tmp_path):
    made = Outbox(tmp_path / "out")
    made.make()
    return made


def test_a_published_object_is_found_again_and_no_other(outbox):
    work = outbox.new_work(ROW)
    assert outbox.find(ROW) is None
    reason = write_object(work, ROW, "look-at", ["first\nof all", "second"], {"paths": 2})
    assert reason == "first of all (and 1 more)"
    place = outbox.publish(work, ROW, "look-at")
    assert (place / REASON).read_text() == "first\nof all\nsecond\n" and not work.exists()
    outcome, said = outbox.find(ROW)
    assert outcome == "look-at" and said["figures"] == {"paths": 2}
    assert json.loads((place / OBJECT).read_text())["reasons"] == ["first\nof all", "second"]
    other = ObjectRow(8, "chair", "/in/chair.ply", 10, 100, "chair.ply", "running")
    assert outbox.find(other) is None
    assert outbox.taken() == {"chair"}


def test_nothing_is_published_over_something_else(outbox):
    outbox.place("chair", "done").mkdir()
    work = outbox.new_work(ROW)
    write_object(work, ROW, "done", [], {})
    with pytest.raises(OutputError, match="is there already"):
        outbox.publish(work, ROW, "done")
    outbox.clear_work()
    assert not work.exists()


def test_reasons_in_one_line():
    assert in_one_line([]) == "" and in_one_line(["a\n  b"]) == "a b"
    assert in_one_line(["a", "b", "c"]) == "a (and 2 more)"
