"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import numpy as np
import pytest

from nrdf.errors import OutputError
from nrdf.io.atomic import output_errors, write_atomically, write_json


@pytest.mark.parametrize(
    "code, advice",
    [(28, "free some space"), (30, "can only be read"), (13, "allow writing"), (36, "shorter")],
)
def test_the_message_says_what_to_do(code, advice):
    with (
        pytest.raises(OutputError, match=f"cannot write place: .*{advice}"),
        output_errors("place"),
    ):
        raise OSError(code, os.strerror(code))


def test_a_report_is_whole_or_as_it_was(tmp_path, monkeypatch):
    write_json(tmp_path / "x.json", {"a": 1})

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("nrdf.io.atomic.os.replace", full)
    with pytest.raises(OutputError, match="No space"):
        write_json(tmp_path / "x.json", {"a": 2})
    assert json.loads((tmp_path / "x.json").read_text()) == {"a": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["x.json"]


def test_parts_follow_each_other_and_nothing_else_stays(tmp_path):
    write_atomically(tmp_path / "a.bin", [b"one", memoryview(b"two")])
    assert (tmp_path / "a.bin").read_bytes() == b"onetwo"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    write_atomically(tmp_path / "a.bin", [b"old"])

    def interrupted():
        yield b"half"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a.bin", interrupted())
    assert (tmp_path / "a.bin").read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_json_takes_numbers_of_numpy_and_paths_and_keeps_letters(tmp_path):
    write_json(tmp_path / "a.json", {"ä": np.float64(1.5), "b": np.arange(2), "c": Path("x")})
    text = (tmp_path / "a.json").read_text(encoding="utf-8")
    assert "ä" in text
    assert json.loads(text) == {"ä": 1.5, "b": [0, 1], "c": "x"}
