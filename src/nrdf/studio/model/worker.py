"""Work in the background: one job at a time, only the newest of a kind; it can be cancelled."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass

from nrdf.errors import NrdfError

log = logging.getLogger(__name__)

Progress = Callable[[int, int], None]


class Cancelled(Exception):
    """Raised by a job's progress callback after it was cancelled."""


@dataclass(frozen=True)
class _Job:
    kind: str
    what: str
    work: Callable[[Progress], None]
    delay_s: float


class Worker:
    """Runs jobs in a thread of its own.

    started(what), progress(done, all), ended(error or ""): called from that thread.
    """

    def __init__(
        self,
        started: Callable[[str], None],
        progress: Progress,
        ended: Callable[[str, str], None],
    ) -> None:
        self._started, self._progress, self._ended = started, progress, ended
        self._waiting: list[_Job] = []
        self._running: _Job | None = None
        self._cancelled = False
        self._stopped = False
        self._changed = threading.Condition()
        threading.Thread(target=self._run, name="studio worker", daemon=True).start()

    @property
    def busy(self) -> bool:
        """Whether a job runs or waits."""
        with self._changed:
            return self._running is not None or bool(self._waiting)

    def has_job(self, kind: str) -> bool:
        """Whether a job of that kind runs or waits."""
        with self._changed:
            running = [] if self._running is None else [self._running]
            return any(job.kind == kind for job in (*running, *self._waiting))

    def submit(
        self,
        kind: str,
        what: str,
        work: Callable[[Progress], None],
        delay_s: float = 0.0,
        replaces: bool = True,
    ) -> None:
        """Run `work(progress)` after a delay; it replaces one of its kind that waits or runs, or,
        unless it `replaces`, that waits."""
        with self._changed:
            self._waiting = [job for job in self._waiting if job.kind != kind]
            self._waiting.append(_Job(kind, what, work, delay_s))
            if replaces and self._running is not None and self._running.kind == kind:
                self._cancelled = True
            self._changed.notify_all()

    def cancel(self) -> None:
        """Stop what runs at its next step, and drop what waits."""
        with self._changed:
            self._waiting.clear()
            self._cancelled = True
            self._changed.notify_all()

    def stop(self) -> None:
        """End the thread."""
        with self._changed:
            self._stopped = self._cancelled = True
            self._waiting.clear()
            self._changed.notify_all()

    def wait(self, seconds: float) -> bool:
        """Wait until nothing runs or waits; whether that came in time."""
        with self._changed:
            return self._changed.wait_for(
                lambda: self._running is None and not self._waiting, seconds
            )

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._stopped)
                if self._stopped:
                    return
                self._running, self._cancelled = self._waiting.pop(0), False
                job = self._running
                # A job that is replaced at once, as by a slider, never begins.
                replaced = self._changed.wait_for(lambda: self._cancelled, job.delay_s)
            error = "cancelled" if replaced else ""
            try:
                if not replaced:
                    self._started(job.what)
                    job.work(self._report)
            except Cancelled:
                error = "cancelled"
            except NrdfError as problem:
                error = str(problem)
            except Exception as problem:
                log.exception("%s failed", job.what)
                error = f"{type(problem).__name__}: {problem}; this is a bug of nrdf"
            with self._changed:
                self._running = None
                last = not self._waiting
                self._changed.notify_all()
            if last or error not in ("", "cancelled"):
                self._ended(job.what, error)

    def _report(self, done: int, total: int) -> None:
        if self._cancelled:
            raise Cancelled
        self._progress(done, total)
