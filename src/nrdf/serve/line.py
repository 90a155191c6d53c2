"""A line: objects are queued, worked on, judged and published, each once, whatever dies when."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.errors import OutputError
from nrdf.io.locks import write_lock
from nrdf.serve.outbox import Outbox, write_object
from nrdf.serve.pool import Answer, Pool, worker_command
from nrdf.serve.store import ObjectRow, Outcome, Store
from nrdf.serve.watch import ArrivedFile, Watcher

if TYPE_CHECKING:
    from nrdf.cell.work_cell import WorkCell

log = logging.getLogger(__name__)

MOST_ATTEMPTS = 2
"""A worker that died is started again with its object once; then the object is refused."""
_MOST_STARTS = 10
"""Attempts of an object that are ended together with the whole line."""
_PAUSE_S = 5.0  # after a full disk
_BACKLOG = "line"


@dataclass
class Line:
    """One process's line: the store, the outbox and the workers. Step it from one thread."""

    outbox: Outbox
    store: Store
    pool: Pool
    watcher: Watcher | None = None
    paused: str = ""
    changed: int = 0
    on_end: Callable[[ObjectRow], None] = lambda row: None
    _until: float = 0.0
    _deaths: dict[int, int] = field(default_factory=dict)

    def recover(self) -> None:
        """Set right what a run left that was killed: published objects get their outcome, others
        wait again."""
        for row in self.store.rows("running"):
            found = self.outbox.find(row)
            if found is not None:
                outcome, said = found
                self.store.finish(row.id, outcome, said["reason"], said["figures"])
            elif row.attempts >= _MOST_STARTS:
                self._refuse(row, f"{row.attempts} runs ended while they worked on it")
            else:
                self.store.wait_again(row.id, "its run was ended")
        self.outbox.clear_work()

    def step(self) -> None:
        """Take what has arrived, give work to free workers, publish what they have done.

        Raises OutputError where the store cannot be written, and ProcessError for workers that
        cannot start.
        """
        if self.watcher is not None:
            for file in self.watcher.arrived():
                self.take(file)
        for answer in self.pool.answers():
            self._answered(answer)
        if time.monotonic() < self._until:
            return
        self.paused = ""
        for _ in range(self.pool.free):
            row = self.store.claim()
            if row is None:
                break
            self.changed += 1
            self.pool.submit(row, self.outbox.new_work(row))

    def take(self, file: ArrivedFile) -> int | None:
        """Queue a file; the id of its row, None where it has one."""
        source = str(file.path.absolute())
        if self.store.find(source, file.bytes, file.mtime_ns) is not None:
            return None
        self.changed += 1
        return self.store.add(source, file.bytes, file.mtime_ns, file.label, self.outbox.taken())

    @property
    def idle(self) -> bool:
        """Whether nothing waits, runs or settles."""
        counts = self.store.counts()
        settling = self.watcher.settling() if self.watcher is not None else 0
        return not (counts["waiting"] or counts["running"] or settling)

    def _answered(self, answer: Answer) -> None:
        row, content = answer.row, answer.content
        self.changed += 1
        if content is None:
            self._deaths[row.id] = self._deaths.get(row.id, 0) + 1
            limit = "limit" in answer.reason  # a second try would only take as long
            if limit or self._deaths[row.id] >= MOST_ATTEMPTS:
                self._refuse(row, answer.reason)
            else:
                self.store.wait_again(row.id, answer.reason)
        elif content["again"]:
            self._pause(row, content["reason"])
        else:
            try:
                self.outbox.publish(answer.work, row, content["outcome"])
            except OutputError as error:
                self._pause(row, str(error))
                return
            self._end(row, content["outcome"], content["reason"], content["figures"])

    def _refuse(self, row: ObjectRow, reason: str) -> None:
        work = self.outbox.new_work(row)
        try:
            write_object(work, row, "refused", [reason], {})
            self.outbox.publish(work, row, "refused")
        except OutputError as error:
            self._pause(row, str(error))
            return
        self._end(row, "refused", reason, {})

    def _end(
        self, row: ObjectRow, outcome: Outcome, reason: str, figures: Mapping[str, Any]
    ) -> None:
        self.store.finish(row.id, outcome, reason, figures)
        self._deaths.pop(row.id, None)
        ended = self.store.row(row.id)
        if ended is not None:
            self.on_end(ended)

    def _pause(self, row: ObjectRow, reason: str) -> None:
        """Put an object back for a reason that is not its own, and wait a while."""
        log.warning("%s; trying again in %g s", reason, _PAUSE_S)
        self.store.wait_again(row.id, reason, counts=False)
        self.paused, self._until = reason, time.monotonic() + _PAUSE_S


@contextmanager
def open_line(
    cell: WorkCell, cell_file: Path, out: Path, inbox: Path | None, workers: int | None = None
) -> Iterator[Line]:
    """A line that is ready to step; nobody else's meanwhile. inbox: the folder to watch, if any.

    Raises OutputError where another line works in `out`, or it cannot be written.
    """
    outbox = Outbox(out)
    outbox.make()
    with write_lock(out / _BACKLOG):
        store = Store(out)
        try:
            size = workers or cell.line.workers
            limits = (cell.line.time_limit_s, cell.line.memory_limit_mb)
            with Pool(worker_command(cell_file), size, *limits) as pool:
                watcher = Watcher(inbox, cell.line.settle_s) if inbox is not None else None
                line = Line(outbox, store, pool, watcher)
                line.recover()
                yield line
        finally:
            store.close()
