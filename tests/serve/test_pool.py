"""Workers: their limits, their deaths, their answers."""

from __future__ import annotations

import os
import sys
import time

import pytest

from nrdf.errors import ProcessError
from nrdf.serve.pool import Pool, resident_mb


def test_workers_that_cannot_start_say_why():
    code = 'print(\'{"failed": "no cell file"}\', flush=True)'
    with (
        Pool([sys.executable, "-c", code], 1, 5.0, 1000) as pool,
        pytest.raises(ProcessError, match="no cell file"),
    ):
        for _ in range(200):
            pool.free  # noqa: B018
            pool.answers()
            time.sleep(0.05)
    with (
        Pool([sys.executable, "-c", "import sys; sys.exit(3)"], 1, 5.0, 1000) as pool,
        pytest.raises(ProcessError, match=r"cannot start.*exit code 3"),
    ):
        for _ in range(200):
            pool.free  # noqa: B018
            pool.answers()
            time.sleep(0.05)


def test_limits_of_time_and_memory_end_a_worker_and_its_object_is_refused(start, finish, tmp_path):
    line = start(size=2, seconds=1.5, memory_mb=400)
    (tmp_path / "inbox" / "slow").write_text("sleep 60")
    (tmp_path / "inbox" / "big").write_text("grow 600")
    (tmp_path / "inbox" / "good").write_text("ok")
    rows = finish(line)
    assert rows["good"].state == "done"
    assert rows["slow"].state == "refused" and "time limit of 1.5 s" in rows["slow"].reason
    assert rows["big"].state == "refused" and "memory limit of 400 MB" in rows["big"].reason
    assert line.pool.restarts == 2


def test_memory_of_this_process_is_known_on_linux():
    mine = resident_mb(os.getpid())
    assert mine is None or mine > 10
    assert resident_mb(2**22 + 1) is None
