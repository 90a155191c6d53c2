"""Many independent shapes on several processes, none of which can spoil the others."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "IGL_NUM_THREADS")
CRASHED = "the process that worked on it died: out of memory, or a fault in a library"


def each(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[Task, Result | Exception]]:
    """Each task with the result of `work(task)` or what it raised, as they come.

    `work` must be importable by name. A process that dies takes only its own task with it: tasks
    that were under way then are tried again one by one. With one worker everything runs in this
    process. On Ctrl-C running tasks end, the others are dropped.
    """
    if workers <= 1:
        for task in tasks:
            yield task, _attempt(work, task)
        return
    lost: list[Task] = []
    for task, result in _pooled(work, tasks, workers):
        if isinstance(result, BrokenProcessPool):
            lost.append(task)
        else:
            yield task, result
    for task in lost:
        for _, result in _pooled(work, [task], 1):
            died = isinstance(result, BrokenProcessPool)
            yield task, RuntimeError(CRASHED) if died else result


def _pooled(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[tuple[Task, Result | Exception]]:
    context = get_context("spawn")
    with _one_thread_each():
        pool = ProcessPoolExecutor(min(workers, len(tasks) or 1), context, _ignore_interrupt)
        try:
            futures: dict[Future[Any], Task] = {}
            for task in tasks:
                try:
                    futures[pool.submit(work, task)] = task
                except BrokenProcessPool as error:
                    yield task, error
            for future in as_completed(futures):
                raised = future.exception()
                if raised is not None and not isinstance(raised, Exception):
                    raise raised
                yield futures[future], future.result() if raised is None else raised
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _attempt(work: Callable[[Task], Result], task: Task) -> Result | Exception:
    try:
        return work(task)
    except Exception as error:
        return error


def _ignore_interrupt() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process decides what to do


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started meanwhile use one thread each: the pool has one process for each core."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update({name: "1" for name in _THREADS})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
