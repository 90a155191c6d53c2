"""Work mapped over many objects: in this process, on local workers, or on a Dask cluster."""

from __future__ import annotations

import logging
from asyncio import CancelledError
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any

from nrdf.errors import ConfigError, NrdfError

log = logging.getLogger(__name__)

_IN_FLIGHT = 4
"""Tasks a worker that are sent ahead: a million at once would fill the scheduler's memory."""
_CONNECT_S = 10.0
_GONE = (
    "the Dask scheduler has gone: start it again, and give the same command; what is done stays "
    "done"
)
_NEEDED = "several workers need the package distributed: pip install 'nrdf[cluster]'"


class ClusterError(NrdfError):
    """A scheduler that cannot be reached, or that has gone."""


def map_objects(
    function: Callable[..., Any],
    items: Sequence[tuple[Any, ...]],
    workers: int = 1,
    cluster: str | None = None,
) -> Iterator[tuple[int, Any]]:
    """`function(*item)` for each item: its index and result, as they come.

    workers: local processes; 1 is a plain loop in this process. cluster: address of a Dask
    scheduler instead, whose workers see the same files and have the same nrdf. An error of the
    function is raised as it comes; a task whose worker dies twice is done last, by itself, and
    where that worker dies too, a ClusterError is its result. Raises ConfigError where the package
    distributed is missing, and ClusterError for a scheduler that cannot be reached or goes away.
    """
    if cluster is None and workers == 1:
        yield from ((index, function(*item)) for index, item in enumerate(items))
        return
    with _client(workers, cluster) as client:
        yield from _mapped(client, function, items)


@contextmanager
def _client(workers: int, cluster: str | None) -> Iterator[Any]:
    """A client of a cluster, started here unless there is an address."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise ConfigError(_NEEDED) from None
    # A task that kills its worker twice would kill them all.
    with dask.config.set({"distributed.scheduler.allowed-failures": 1}):
        if cluster is not None:
            try:
                client = Client(cluster, timeout=_CONNECT_S)
            except (OSError, ValueError, RuntimeError) as error:
                raise ClusterError(f"no Dask scheduler answers at {cluster}: {error}") from None
            _say(client)
            try:
                yield client
            finally:
                client.close(timeout=2)
            return
        with (
            LocalCluster(
                n_workers=workers, threads_per_worker=1, dashboard_address=None,
                silence_logs=logging.ERROR,
            ) as local,
            Client(local) as client,
        ):  # fmt: skip
            yield client


def _say(client: Any) -> None:
    count = len(client.scheduler_info(n_workers=-1)["workers"])
    log.info("%d workers; dashboard: %s", count, client.dashboard_link)
    if not count:
        log.warning("the cluster has no workers yet; waiting for some")


def _mapped(
    client: Any, function: Callable[..., Any], items: Sequence[tuple[Any, ...]]
) -> Iterator[tuple[int, Any]]:
    from distributed import as_completed
    from distributed.comm import CommClosedError
    from distributed.scheduler import KilledWorker

    indices: dict[str, int] = {}
    waiting = iter(enumerate(items))

    def send(count: int) -> list[Any]:
        futures = []
        for index, item in islice(waiting, count):
            future = client.submit(function, *item, pure=False)
            indices[future.key] = index
            futures.append(future)
        return futures

    ahead = _IN_FLIGHT * max(len(client.scheduler_info(n_workers=-1)["workers"]), 2)

    def outcome(future: Any) -> tuple[Any, ...]:
        """A task's result, alone in a tuple; none where its workers died."""
        try:
            return (future.result(),)
        except KilledWorker:
            return ()
        except (CommClosedError, CancelledError) as error:
            raise ClusterError(_GONE) from error
        finally:
            future.release()

    coming = as_completed(send(ahead))
    suspects = []
    for future in coming:
        index, result = indices.pop(future.key), outcome(future)
        coming.update(send(1))
        if result:
            yield index, result[0]
        else:
            suspects.append(index)
    # Whatever waits at a worker goes down with it: which task it was shows when each is alone.
    for index in suspects:
        result = outcome(client.submit(function, *items[index], pure=False))
        yield (
            index,
            result[0]
            if result
            else ClusterError(
                "its worker died whenever it was at work on it: too little memory, perhaps"
            ),
        )
