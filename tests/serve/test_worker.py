"""A worker's protocol, and that it ends with its parent."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import time

import pytest

from builders.line_process import environment
from nrdf.serve.store import ObjectRow
from nrdf.serve.worker import serve

ROW = ObjectRow(3, "a", "/in/a.ply", 1, 1, "a.ply", "running")


def test_each_task_is_answered_with_its_id():
    task = json.dumps({"row": vars(ROW), "work": "/w"}) + "\n"
    answers = io.StringIO()
    serve(io.StringIO(2 * task), answers, lambda row, work: {"said": f"{row.name} in {work}"})
    assert [json.loads(line) for line in answers.getvalue().splitlines()] == [
        {"ready": True}, {"id": 3, "said": "a in /w"}, {"id": 3, "said": "a in /w"}
    ]  # fmt: skip


def test_a_bad_cell_file_is_told_to_the_line(tmp_path):
    words = [sys.executable, "-m", "nrdf.serve.worker", str(tmp_path / "no.yaml")]
    done = subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 2 and "no cell file" in json.loads(done.stdout)["failed"]


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_worker_ends_soon_after_its_line_was_killed(tmp_path):
    code = (
        "import subprocess, sys, time; from builders.line_process import WORKER\n"
        "p = subprocess.Popen(WORKER, stdin=subprocess.PIPE); print(p.pid, flush=True)\n"
        "time.sleep(60)"
    )
    line = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment()
    )
    pid = int(line.stdout.readline())
    time.sleep(1.0)
    line.kill()
    line.wait()
    for _ in range(100):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    pytest.fail("the worker lives on")
