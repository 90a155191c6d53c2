import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nrdf.io.atomic import write_atomically
from nrdf.shapes.pool import CRASHED, run_tasks


def die_of_three(task):
    if task == 3:
        os._exit(1)
    if task == 4:
        raise ValueError("four")
    return task, os.environ.get("OMP_NUM_THREADS")


def test_a_process_that_dies_takes_only_its_own_task():
    before = os.environ.get("OMP_NUM_THREADS")
    results = dict(run_tasks(die_of_three, [1, 2, 3, 4], workers=2))
    assert str(results.pop(3)) == CRASHED
    assert str(results.pop(4)) == "four"
    assert results == {task: (task, "1") for task in (1, 2)}
    assert os.environ.get("OMP_NUM_THREADS") == before


def test_one_worker_runs_in_this_process():
    results = dict(run_tasks(lambda task: (task, os.getpid()), [1, 2], workers=1))
    assert results == {task: (task, os.getpid()) for task in (1, 2)}


@pytest.mark.parametrize("workers", [1, 2])
def test_nothing_to_do_is_done_at_once(workers):
    assert list(run_tasks(die_of_three, [], workers)) == []


def write_slowly(path):
    """Be writing a file nearly all the time."""
    for _ in range(100):
        write_atomically(Path(path), pieces())


def pieces():
    for _ in range(20):
        time.sleep(0.005)
        yield b"piece"


@pytest.mark.skipif(os.name != "posix", reason="signals as on Unix")
def test_ctrl_c_ends_all_processes_and_leaves_no_half_written_file(tmp_path):
    script = (
        f"import signal, sys; sys.path.insert(0, {str(Path(__file__).parents[2])!r})\n"
        # Tests that run in a shell's background inherit that Ctrl-C is ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from tests.shapes.test_pool import write_slowly\n"
        "from nrdf.shapes.pool import run_tasks\n"
        "if __name__ == '__main__':\n"
        f"    print(list(run_tasks(write_slowly, [f'{tmp_path}/{{i}}' for i in range(40)], 2)))\n"
    )
    (tmp_path / "script.py").write_text(script)
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "script.py")],
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while not (tmp_path / "1").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    error = process.communicate(timeout=30)[1].decode()
    assert process.returncode != 0 and "KeyboardInterrupt" in error
    assert gone_within(10.0, process.pid)
    left = {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.name != "script.py"}
    assert set(left) <= {"0", "1", "2", "3"} and left
    assert set(left.values()) == {b"piece" * 20}


def gone_within(seconds, group):
    """Whether the last process of a group ends within a time."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def die_of_a_large_task(task):
    number, _ = task
    if number == 1:
        os._exit(1)
    return number


def test_a_process_that_dies_while_large_tasks_wait_keeps_nobody_waiting():
    """More than a pipe holds is on its way to processes that are no more."""
    tasks = [(number, bytes(10_000_000)) for number in range(8)]
    results = {task[0]: result for task, result in run_tasks(die_of_a_large_task, tasks, workers=2)}
    assert str(results.pop(1)) == CRASHED
    assert results == {number: number for number in range(8) if number != 1}
