import os

import pytest

from nrdf.shapes.pool import CRASHED, each


def die_of_three(task):
    if task == 3:
        os._exit(1)
    if task == 4:
        raise ValueError("four")
    return task, os.environ.get("OMP_NUM_THREADS")


def test_a_process_that_dies_takes_only_its_own_task():
    before = os.environ.get("OMP_NUM_THREADS")
    results = dict(each(die_of_three, [1, 2, 3, 4], workers=2))
    assert str(results.pop(3)) == CRASHED
    assert str(results.pop(4)) == "four"
    assert results == {task: (task, "1") for task in (1, 2)}
    assert os.environ.get("OMP_NUM_THREADS") == before


def test_one_worker_runs_in_this_process():
    results = dict(each(lambda task: (task, os.getpid()), [1, 2], workers=1))
    assert results == {task: (task, os.getpid()) for task in (1, 2)}


@pytest.mark.parametrize("workers", [1, 2])
def test_nothing_to_do_is_done_at_once(workers):
    assert list(each(die_of_three, [], workers)) == []
