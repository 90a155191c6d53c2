"""Independent tasks on several processes; one that crashes does not stop the others."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "IGL_NUM_THREADS")
CRASHED = "the process that worked on it died: out of memory, or a fault in a library"


def run_tasks(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Generator[tuple[Task, Result | Exception], None, None]:
    """Each task with the result of `work(task)` or what it raised, as they come.

    `work` must be importable by name. A process that dies takes only its own task with it: tasks
    that were under way then are tried again one by one. With one worker everything runs in this
    process. When the loop over the results is left early (close the generator), or on Ctrl-C, the
    processes are ended; files that they write by `write_atomically` are whole or not there.
    """
    if workers <= 1:
        for task in tasks:
            yield task, _result_or_error(work, task)
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
        pool = ProcessPoolExecutor(min(workers, len(tasks) or 1), context, _ignore_interrupts)
        try:
            futures: dict[Future[Any], Task] = {}
            for task in tasks:
                try:
                    futures[pool.submit(_in_process, work, task)] = task
                except BrokenProcessPool as error:
                    yield task, error
            for future in as_completed(futures):
                raised = future.exception()
                if raised is not None and not isinstance(raised, Exception):
                    raise raised
                yield futures[future], future.result() if raised is None else raised
        except BaseException:
            with _no_interrupt():
                # Asking politely, by shutdown alone, has been seen to wait forever after Ctrl-C.
                processes = list((pool._processes or {}).values())
                for process in processes:
                    process.terminate()
                for process in processes:
                    process.join()
                _release_queue(pool)
                pool.shutdown(wait=True, cancel_futures=True)
            raise
        if pool._broken:
            _release_queue(pool)
        pool.shutdown()


def _release_queue(pool: ProcessPoolExecutor) -> None:
    """Close the queue on which a thread still waits to hand a task to processes that have ended.

    Python 3.10 waits for it forever when the pool shuts down; later versions do this themselves
    (CPython issue 94777).
    """
    queue = getattr(pool, "_call_queue", None)
    if sys.version_info < (3, 11) and queue is not None:
        queue._reader.close()


def _result_or_error(work: Callable[[Task], Result], task: Task) -> Result | Exception:
    try:
        return work(task)
    except Exception as error:
        return error


def _in_process(work: Callable[[Task], Result], task: Task) -> Result:
    # Told to end at work, by an exception, so files are tidied up; elsewhere (while it imports what
    # the work needs) at once, because there the exception would be reported with a traceback.
    before = signal.signal(signal.SIGTERM, _end)
    try:
        return work(task)
    except SystemExit:  # the pool would go on with the next task
        os._exit(1)
    finally:
        signal.signal(signal.SIGTERM, before)


def _end(*_: object) -> None:
    # A second SIGTERM, which the pool sends too, would interrupt the tidying up.
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sys.exit(1)


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process decides what to do


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Ignore Ctrl-C within the block; only the main thread can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started within the block use one thread: the pool has a process for each core."""
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
