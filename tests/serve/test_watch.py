"""The watched folder: a file counts when it has stopped growing."""

from __future__ import annotations

import os
import shutil

import pytest

from nrdf.errors import DataError
from nrdf.serve.watch import Watcher


def labels(watcher, now):
    return [file.label for file in watcher.arrived(now)]


def test_a_file_counts_once_when_it_has_stopped_growing(tmp_path):
    watcher, file = Watcher(tmp_path, 1.0), tmp_path / "a.ply"
    file.write_bytes(b"1")
    assert labels(watcher, 0.0) == [] and watcher.settling() == 1
    file.write_bytes(b"12")
    assert labels(watcher, 1.1) == []
    assert labels(watcher, 2.2) == ["a.ply"] and watcher.settling() == 0
    assert labels(watcher, 9.9) == []
    file.write_bytes(b"123")
    assert labels(watcher, 10.0) == [] and labels(watcher, 12.0) == ["a.ply"]


def test_hidden_empty_and_unfinished_files_do_not_count_and_folders_do(tmp_path):
    for name in (".a.ply", "b.ply.part", "c.tmp", "empty.ply", "chair/d.ply", "1/2/3/4/e.ply"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("" if name == "empty.ply" else "x")
    os.symlink(tmp_path, tmp_path / "loop")
    watcher = Watcher(tmp_path, 0.0)
    watcher.arrived(0.0)
    assert labels(watcher, 1.0) == ["chair/d.ply"]
    shutil.rmtree(tmp_path / "chair")
    watcher.arrived(2.0)
    assert not watcher._given and not watcher._seen


def test_an_inbox_that_goes_away_is_an_error_in_words(tmp_path):
    with pytest.raises(DataError, match="cannot read the inbox"):
        Watcher(tmp_path / "none", 1.0).arrived()
