"""One run at a time, told from dead ones by the system's own locks."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import pytest

from nrdf.errors import OutputError
from nrdf.io.locks import remove_partial_files, write_lock

CLAIM = """
import os, sys
from nrdf.io.locks import write_lock
with write_lock(sys.argv[1]):
    open(os.path.join(os.path.dirname(sys.argv[1]), ".place.0123abcd.part"), "w").close()
    os.kill(os.getpid(), 9)
"""


def test_a_claim_is_for_one_and_leaves_nothing(tmp_path):
    with write_lock(tmp_path / "a" / "place"):
        assert [p.name for p in (tmp_path / "a").iterdir()] == [".place.lock"]
        with (
            pytest.raises(OutputError, match=r"another run is writing to .*place: wait"),
            write_lock(tmp_path / "a" / "place"),
        ):
            pytest.fail("the block must not run")
        with write_lock(tmp_path / "a" / "another"):
            pass
    assert list(tmp_path.iterdir()) == []


def test_who_is_told_to_wait_waits(tmp_path, caplog):
    order = []

    def second():
        with write_lock(tmp_path / "place", wait=True):
            order.append("second")

    with caplog.at_level("INFO"), write_lock(tmp_path / "place"):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join(0.3)
        order.append("first")
    thread.join(30)
    assert order == ["first", "second"] and "waiting for another run" in caplog.text
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_dead_runs_claim_holds_nobody_up_and_what_it_left_is_cleared(tmp_path):
    done = subprocess.run([sys.executable, "-c", CLAIM, str(tmp_path / "place")])
    assert done.returncode == -9
    assert {p.name for p in tmp_path.iterdir()} == {".place.lock", ".place.0123abcd.part"}
    (tmp_path / ".other.0123abcd.part").write_text("another's")
    (tmp_path / ".place.mine.part").write_text("mine")
    (tmp_path / ".place.89abcdef.tmp").write_text("a file, not a folder of ours")
    with write_lock(tmp_path / "place"):
        pass
    left = {".other.0123abcd.part", ".place.mine.part", ".place.89abcdef.tmp"}
    assert {p.name for p in tmp_path.iterdir()} == left


def test_halves_of_a_name_that_another_run_holds_stay(tmp_path):
    (tmp_path / ".a.json.0123abcd.part").write_text("being written")
    (tmp_path / ".b.json.0123abcd.part").write_text("left")
    with write_lock(tmp_path / "a.json"):
        (tmp_path / ".a.json.89abcdef.part").write_text("being written")
        remove_partial_files(tmp_path)
        names = {p.name for p in tmp_path.iterdir()}
    assert names == {".a.json.lock", ".a.json.89abcdef.part"}


def test_a_planted_link_for_a_lock_is_not_followed(tmp_path):
    (tmp_path / ".place.lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError, match="cannot write"), write_lock(tmp_path / "place"):
        pytest.fail("the block must not run")
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.parametrize("name", ["x" * 300, "a\0b"])
def test_a_name_that_no_file_can_have_is_an_error_in_words(tmp_path, name):
    with pytest.raises(OutputError, match="cannot write"), write_lock(f"{tmp_path}/{name}"):
        pytest.fail("the block must not run")
    assert list(tmp_path.iterdir()) == []
