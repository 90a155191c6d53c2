"""Independent tasks: in this process, on local workers, or on a Dask cluster, by one function."""

from __future__ import annotations

import logging
import os
import pickle
import signal
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib.util import find_spec
from itertools import islice
from typing import Any, TypeVar

from nrdf.errors import ConfigError, NrdfError

Task = TypeVar("Task")
Result = TypeVar("Result")

Workers = int | str
"""How many processes of this machine, or the address of a Dask scheduler (tcp://host:8786)."""

log = logging.getLogger(__name__)

_IN_FLIGHT = 4
"""Tasks a worker that are sent ahead: a million at once would fill the scheduler's memory."""
_CONNECT_S = 10.0
_NO_LIMIT = 0
"""Of a local worker's memory: one that is held up at its share of the machine may never go on."""
_GONE = (
    "the Dask scheduler has gone: start it again, and give the same command; what is done stays "
    "done"
)
_NEEDED = "several workers need the package distributed: pip install 'nrdf[cluster]'"


class ClusterError(NrdfError):
    """A scheduler that cannot be reached, or that has gone."""


class TaskLost(NrdfError):
    """A task whose worker died whenever it was at work on it."""

    def __init__(self) -> None:
        super().__init__(
            "the process that worked on it died, each time: out of memory, or a fault in a library"
        )


def chosen_workers(
    workers: int | None, cluster: str | None, unless_given: int | None = None
) -> Workers:
    """What --workers and --cluster say. Unless given, all cores; one where Dask is not installed.

    Raises ConfigError where both are given.
    """
    if cluster is not None:
        if workers is not None:
            raise ConfigError(
                "--workers starts processes here, --cluster uses others: give one of them"
            )
        return cluster
    if workers is not None or unless_given is not None:
        return workers or unless_given or 1
    cores = os.cpu_count() or 1
    if cores > 1 and find_spec("distributed") is None:
        log.info("one of %d cores is used; for all of them: pip install 'nrdf[cluster]'", cores)
        return 1
    return cores


def run_tasks(
    work: Callable[[Task], Result], tasks: Sequence[Task], workers: Workers = 1
) -> Generator[tuple[Task, Result | Exception], None, None]:
    """Each task with the result of `work(task)` or what it raised, as they come.

    With one worker everything runs in this process, in order. Local workers have one thread each.
    The workers of a cluster must have one too, see the same files and have the same nrdf; they work
    in this process's folder. A task whose worker dies is done once more; where
    that worker dies too, TaskLost is its result.
    When the loop over the results is left early (close the generator), or on Ctrl-C, local workers
    end. Raises ConfigError where the package distributed is missing, and ClusterError for a
    scheduler that cannot be reached or goes away.
    """
    if not tasks or (isinstance(workers, int) and min(workers, len(tasks)) <= 1):
        for task in tasks:
            yield task, _outcome(work, task)
        return
    with _client(workers if isinstance(workers, str) else min(workers, len(tasks))) as client:
        yield from _mapped(client, work, tasks)


@contextmanager
def _client(workers: Workers) -> Iterator[Any]:
    """A client of a cluster, which is started here unless there is an address."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise ConfigError(_NEEDED) from None
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what it says, we say
    # A task that kills its worker twice would kill them all.
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        if isinstance(workers, str):
            try:
                client = Client(workers, timeout=_CONNECT_S)
            except (OSError, ValueError, RuntimeError) as error:
                raise ClusterError(f"no Dask scheduler answers at {workers}: {error}") from None
            try:
                _say(client)
                yield client
            finally:
                client.close(timeout=2)
            return
        dashboard = "127.0.0.1:0" if find_spec("bokeh") else None
        with (
            LocalCluster(
                n_workers=workers, threads_per_worker=1, memory_limit=_NO_LIMIT,
                dashboard_address=dashboard, silence_logs=logging.CRITICAL,
                env={"IGL_NUM_THREADS": "1"},  # the others are one by Dask's defaults
            ) as local,
            Client(local) as client,
        ):  # fmt: skip
            if dashboard:
                _say(client)
            try:
                yield client
            except BaseException:  # left early, or Ctrl-C: to end what runs politely takes long
                for nanny in local.workers.values():
                    nanny.auto_restart = False
                    with suppress(OSError, TypeError):  # it has just ended
                        os.kill(nanny.pid, signal.SIGTERM)
                raise


def _say(client: Any) -> None:
    found = client.scheduler_info(n_workers=-1)["workers"]
    shared = [name for name, worker in found.items() if worker["nthreads"] > 1]
    if shared:
        raise ClusterError(
            f"the worker {shared[0]} has several threads: start workers with --nthreads 1, and "
            "more of them (dask worker --nworkers 8 --nthreads 1 ADDRESS)"
        )
    count = len(found)
    log.info("%d workers; dashboard: %s", count, client.dashboard_link)
    if not count:
        log.warning("the cluster has no workers yet; waiting for some")


def _count(client: Any) -> int:
    return len(client.scheduler_info(n_workers=-1)["workers"])


def _mapped(
    client: Any, work: Callable[[Task], Result], tasks: Sequence[Task]
) -> Iterator[tuple[Task, Result | Exception]]:
    from distributed import as_completed
    from distributed.comm import CommClosedError
    from distributed.protocol.pickle import dumps
    from distributed.scheduler import KilledWorker

    folder, pickled = os.getcwd(), dumps(work)
    under_way: dict[str, Task] = {}
    waiting = iter(tasks)

    def submit(task: Task) -> Any:
        return client.submit(_outcome_in, folder, pickled, task, pure=False)

    def send(count: int) -> list[Any]:
        futures = []
        for task in islice(waiting, count):
            future = submit(task)
            under_way[future.key] = task
            futures.append(future)
        return futures

    def came(future: Any) -> Any:
        try:
            return future.result()
        except KilledWorker:
            return TaskLost()
        except (CommClosedError, CancelledError) as error:
            raise ClusterError(_GONE) from error
        finally:
            future.release()

    coming = as_completed(send(_IN_FLIGHT * max(_count(client), 2)))
    suspects = []
    for future in coming:
        task, result = under_way.pop(future.key), came(future)
        coming.update(send(1))
        if isinstance(result, TaskLost):
            suspects.append(task)
        else:
            yield task, result
    # Whatever waits at a worker goes down with it: which task it was shows when each is alone.
    for task in suspects:
        yield task, came(submit(task))


def _outcome_in(folder: str, pickled: bytes, task: Any) -> Any:
    """The outcome in a folder, from which relative paths are."""
    try:
        os.chdir(folder)
    except OSError as error:
        return ClusterError(
            f"a worker cannot use the folder {folder}: {error.strerror}; workers must see the same "
            "files"
        )
    return _outcome(_unpickled(pickled), task)


@lru_cache(maxsize=1)
def _unpickled(work: bytes) -> Any:
    """The work of all tasks, read once a worker."""
    return pickle.loads(work)


def _outcome(work: Callable[[Task], Result], task: Task) -> Result | Exception:
    try:
        return work(task)
    except Exception as error:
        return error
