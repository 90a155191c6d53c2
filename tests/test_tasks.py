"""Independent tasks: the same in one process and on a cluster, whatever dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from nrdf.errors import ConfigError
from nrdf.io.atomic import write_atomically
from nrdf.tasks import ClusterError, TaskLost, chosen_workers, run_tasks

pytest.importorskip("distributed")

NUMBERS = list(range(20))
TESTS = Path(__file__).parent


def square(number):
    return number * number


def fragile(place, task):
    """Ends its worker at 1 the first time, at -1 every time; 4 is an error."""
    number = task[0]
    mark = Path(place) / str(number)
    if number == -1 or (number == 1 and not mark.exists()):
        mark.touch()
        os._exit(1)
    if number == 4:
        raise ValueError("four")
    return number, os.environ["OMP_NUM_THREADS"], os.environ["IGL_NUM_THREADS"]


def write_slowly(path):
    """Be writing a file nearly all the time."""
    for _ in range(100):
        write_atomically(Path(path), pieces())


def pieces():
    for _ in range(20):
        time.sleep(0.005)
        yield b"piece"


@pytest.mark.parametrize("workers", [1, 2, "tcp://127.0.0.1:1"])
def test_nothing_to_do_is_done_at_once(workers):
    assert list(run_tasks(square, [], workers)) == []


def test_one_worker_is_a_plain_loop_in_order_in_this_process():
    assert list(run_tasks(square, NUMBERS)) == [(n, n * n) for n in NUMBERS]
    assert [pid for _, pid in run_tasks(lambda _: os.getpid(), NUMBERS)] == [os.getpid()] * 20
    results = dict(run_tasks(lambda n: 1 / n, [1, 0]))
    assert results[1] == 1.0 and isinstance(results[0], ZeroDivisionError)


def test_a_worker_that_dies_costs_its_own_task_alone_and_once_more(tmp_path):
    """While more than a pipe holds is on its way to it."""
    tasks = [(n, bytes(2_000_000)) for n in (-1, *range(1, 8))]
    work = partial(fragile, str(tmp_path))
    results = {task[0]: result for task, result in run_tasks(work, tasks, workers=2)}
    assert isinstance(results.pop(-1), TaskLost)
    assert str(results.pop(4)) == "four"
    assert results == {n: (n, "1", "1") for n in (1, 2, 3, 5, 6, 7)}


@pytest.mark.skipif(os.name != "posix", reason="signals as on Unix")
def test_ctrl_c_ends_all_processes_and_leaves_no_half_written_file(tmp_path):
    script = (
        f"import signal, sys; sys.path.insert(0, {str(TESTS)!r})\n"
        # Tests that run in a shell's background inherit that Ctrl-C is ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from test_tasks import write_slowly\n"
        "from nrdf.tasks import run_tasks\n"
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
    whole = {name: content for name, content in left.items() if not name.startswith(".")}
    assert set(whole) <= {str(n) for n in range(8)} and whole
    assert set(whole.values()) == {b"piece" * 20}


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


@pytest.fixture
def scheduler(tmp_path):
    """Starts a scheduler with two worker processes: its address, and its process."""
    started = []

    def start(threads):
        code = (
            "import time\nfrom distributed import LocalCluster\n"
            "if __name__ == '__main__':\n"
            f" c = LocalCluster(n_workers=2, threads_per_worker={threads},"
            " dashboard_address=None)\n"
            " print(c.scheduler_address, flush=True)\n"
            " time.sleep(300)\n"
        )
        (tmp_path / "scheduler.py").write_text(code)
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        process = subprocess.Popen(
            [sys.executable, str(tmp_path / "scheduler.py")], stdout=subprocess.PIPE, text=True,
            env=environment, cwd=tmp_path,
        )  # fmt: skip
        started.append(process)
        return process.stdout.readline().strip(), process

    yield start
    for process in started:
        process.kill()
        process.wait()


def test_a_cluster_by_its_address_and_one_that_goes_away(scheduler):
    address, process = scheduler(1)
    assert dict(run_tasks(square, NUMBERS, address)) == dict(run_tasks(square, NUMBERS))
    assert dict(run_tasks(os.path.abspath, ["x"], address)) == {"x": os.path.abspath("x")}
    coming = run_tasks(time.sleep, [0.3] * 60, address)
    next(coming)
    process.kill()
    with pytest.raises(ClusterError, match="the Dask scheduler has gone"):
        list(coming)


def test_workers_of_several_threads_are_refused(scheduler):
    with pytest.raises(ClusterError, match="start workers with --nthreads 1"):
        list(run_tasks(square, NUMBERS, scheduler(2)[0]))


def test_a_scheduler_that_does_not_answer_is_an_error_in_words(monkeypatch):
    monkeypatch.setattr("nrdf.tasks._CONNECT_S", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        with pytest.raises(ClusterError, match="no Dask scheduler answers at"):
            list(run_tasks(square, NUMBERS, address))


def test_what_is_to_be_installed_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ConfigError, match=r"pip install 'nrdf\[cluster\]'"):
        list(run_tasks(square, NUMBERS, 2))


def test_workers_unless_given(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    assert chosen_workers(None, None) == 8 and chosen_workers(None, None, 1) == 1
    assert chosen_workers(3, None) == 3 and chosen_workers(None, "tcp://x:1") == "tcp://x:1"
    with pytest.raises(ConfigError, match="give one of them"):
        chosen_workers(1, "tcp://x:1")
    monkeypatch.setattr("nrdf.tasks.find_spec", lambda name: None)
    assert chosen_workers(None, None) == 1 and chosen_workers(8, None) == 8
