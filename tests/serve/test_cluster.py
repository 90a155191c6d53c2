"""Work over many objects: the same in one process and on a cluster, whatever dies."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from nrdf.serve.cluster import ClusterError, map_objects

pytest.importorskip("distributed")


def square(number):
    return number * number


def dies(place, number):
    """Ends its worker the first time, or every time for a negative number."""
    mark = Path(place) / str(number)
    if number < 0 or not mark.exists():
        mark.touch()
        os._exit(1)
    return number


ITEMS = [(n,) for n in range(40)]


def test_one_process_is_a_plain_loop_in_order():
    assert list(map_objects(square, ITEMS)) == [(n, n * n) for n in range(40)]


def test_a_scheduler_that_does_not_answer_is_an_error_in_words(monkeypatch):
    monkeypatch.setattr("nrdf.serve.cluster._CONNECT_S", 0.5)
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        with pytest.raises(ClusterError, match="no Dask scheduler answers at"):
            list(map_objects(square, ITEMS, cluster=address))


def test_local_workers_give_the_same_and_only_the_task_that_kills_them_is_lost(tmp_path):
    assert dict(map_objects(square, ITEMS, workers=2)) == dict(map_objects(square, ITEMS))
    found = dict(map_objects(dies, [(str(tmp_path), n) for n in (1, 2, -3)], workers=2))
    assert isinstance(found[2], ClusterError) and "its worker died whenever" in str(found[2])
    assert (found[0], found[1]) == (1, 2)


@pytest.fixture
def scheduler(tmp_path):
    """The address of a scheduler with two worker processes, and the scheduler's process."""
    code = (
        "import time\nfrom distributed import LocalCluster\n"
        "if __name__ == '__main__':\n"
        " c = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)\n"
        " print(c.scheduler_address, flush=True)\n"
        " time.sleep(300)\n"
    )
    (tmp_path / "scheduler.py").write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "scheduler.py")], stdout=subprocess.PIPE, text=True,
        env=environment,
    )  # fmt: skip
    yield process.stdout.readline().strip(), process
    process.kill()
    process.wait()


def test_a_cluster_by_its_address_and_one_that_goes_away(scheduler):
    address, process = scheduler
    assert dict(map_objects(abs, [(-n,) for n in range(9)], cluster=address)) == {
        n: n for n in range(9)
    }
    coming = map_objects(time.sleep, [(0.3,) for _ in range(60)], cluster=address)
    next(coming)
    process.kill()
    with pytest.raises(ClusterError, match="the Dask scheduler has gone"):
        list(coming)
