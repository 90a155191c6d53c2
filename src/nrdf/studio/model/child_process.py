"""Work in a child process, which can be ended at any time and may crash without harm."""

from __future__ import annotations

import contextlib
import logging
import signal
import sys
import traceback
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any

from nrdf.errors import NrdfError
from nrdf.studio.model.worker import Cancelled, Progress

log = logging.getLogger(__name__)

_POLL_S = 0.2  # how often to look whether the work is cancelled
_PATIENCE_S = 5.0  # for a process that has been told to end


def _ignore(value: Any, *more: Any) -> None:
    """Ignores progress or a phase."""


class ChildProcess:
    """A process that runs `serve(pipe, *args)` and answers through the pipe, a pair a time:
    ("progress", (done, all)), ("phase", words), and at last ("made", value), ("cancelled", None),
    ("refused", NrdfError) or ("failed", traceback).

    gone: makes the error for a process that has ended by itself, from the reason.
    """

    def __init__(
        self, serve: Callable[..., None], args: tuple[Any, ...], gone: Callable[[str], NrdfError]
    ) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_run, args=(serve, other, *args), daemon=True)
        self._gone, self._ended = gone, False
        self._process.start()
        other.close()

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.is_alive()

    def request(self, request: Any, progress: Progress) -> Any:
        """Send a request, and wait for its result; None, sent later, cancels it.

        Raises the NrdfError of the process, what `progress` raises, and what `gone` makes.
        """
        self._send(request)
        try:
            return self.wait(progress)
        except Cancelled:
            if not self._ended:
                self._send(None)
                with contextlib.suppress(Cancelled):
                    self.wait(_ignore)
            raise

    def wait(self, progress: Progress, say: Callable[[str], None] = _ignore) -> Any:
        """Wait for a result; `say` gets the phases of the work. Raises as `request` does."""
        share = (0, 1)
        while True:
            progress(*share)
            try:
                if not self._pipe.poll(_POLL_S):
                    continue
                kind, value = self._pipe.recv()
            except (EOFError, OSError):
                raise self._lost() from None
            if kind == "progress":
                share = value
            elif kind == "phase":
                say(value)
            elif kind == "made":
                return value
            elif kind == "cancelled":
                raise Cancelled
            elif kind == "refused":
                raise value
            else:
                log.error("a process of the studio failed:\n%s", value)
                raise RuntimeError(value.strip().splitlines()[-1])

    def end(self) -> None:
        """End the process; half-written files are removed. Who waits for it gets Cancelled."""
        self._ended = True
        self._pipe.close()
        self._process.terminate()
        self._process.join(_PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _send(self, message: Any) -> None:
        try:
            self._pipe.send(message)
        except OSError:
            raise self._lost() from None

    def _lost(self) -> Exception:
        if self._ended:
            return Cancelled()
        self._process.join(_PATIENCE_S)
        return self._gone(_in_words(self._process.exitcode))


def answer(pipe: Connection, make: Callable[[], Any]) -> None:
    """In the child process: send the result, or why there is none."""
    try:
        pipe.send(("made", make()))
    except Cancelled:
        pipe.send(("cancelled", None))
    except NrdfError as error:
        pipe.send(("refused", error))
    except (EOFError, OSError):
        raise
    except Exception:
        pipe.send(("failed", traceback.format_exc()))


def progress_of(pipe: Connection) -> Progress:
    """In the child process: sends progress, and raises Cancelled once the request is cancelled."""

    def progress(done: int, total: int) -> None:
        if pipe.poll():
            pipe.recv()
            raise Cancelled
        pipe.send(("progress", (done, total)))

    return progress


def _run(serve: Callable[..., None], pipe: Connection, *args: Any) -> None:
    # As an exception, so that half-written files are removed.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        serve(pipe, *args)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # it is ending already


def _in_words(code: int | None) -> str:
    if code is not None and code < 0:
        with contextlib.suppress(ValueError):
            return f"signal {-code}, {signal.strsignal(-code)}"
    return f"code {code}"
