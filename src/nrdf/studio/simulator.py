"""A simulation in a process of its own: pages stay alive, and it can be ended at any time.

The process keeps what it has simulated, to draw and write it when asked.
"""

from __future__ import annotations

import contextlib
import logging
import signal
import sys
import traceback
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nrdf.errors import NrdfError, RobotError
from nrdf.studio.worker import Cancelled, Progress

if TYPE_CHECKING:
    from nrdf.studio.playback import Playback

log = logging.getLogger(__name__)

_LOOKS_EVERY_S = 0.2  # whether the person has cancelled
_PATIENCE_S = 5.0  # for a process that has been told to end


def need_engine() -> None:
    """Raises RobotError, with the line that installs it, where there is no MuJoCo."""
    if find_spec("mujoco") is None:
        raise RobotError(
            "simulating needs MuJoCo, which is not installed: pip install 'nrdf[robot]' (Python "
            "3.11 or newer), then start the studio again"
        )


class Simulator:
    """A process that drives one job on an arm: the bundled one, or that of a file."""

    def __init__(self, job: Path, robot: Path | None = None, tool_frame: str | None = None) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(other, job, robot, tool_frame), daemon=True
        )
        self._ended = False
        self._process.start()
        other.close()

    def drive(self, progress: Progress, say: Callable[[str], None] = lambda what: None) -> Playback:
        """Wait for the simulation; `say` is told what is being done. Raises RobotError and
        ProcessError as `nrdf simulate` does, and what `progress` raises."""
        made: Playback = self._wait(progress, say)
        return made

    def write(
        self, folder: Path, title: str, origin: Mapping[str, Any], progress: Progress
    ) -> dict[str, Any]:
        """Write what `nrdf simulate` writes into a folder that appears whole or not at all; what
        its report.json says. Raises OutputError, and what `progress` raises."""
        self._send((folder, title, dict(origin)))
        try:
            made: dict[str, Any] = self._wait(progress)
        except Cancelled:
            if not self._ended:
                self._send(None)
                with contextlib.suppress(Cancelled):
                    self._wait(lambda done, total: None)
            raise
        return made

    def end(self) -> None:
        """End the process; what it has written half is removed. Who waits for it is cancelled."""
        self._ended = True
        self._pipe.close()
        self._process.terminate()
        self._process.join(_PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _send(self, order: Any) -> None:
        try:
            self._pipe.send(order)
        except OSError:
            raise self._gone() from None

    def _wait(self, progress: Progress, say: Callable[[str], None] = lambda what: None) -> Any:
        """What the process answers."""
        share = (0, 1)
        while True:
            progress(*share)
            try:
                if not self._pipe.poll(_LOOKS_EVERY_S):
                    continue
                kind, value = self._pipe.recv()
            except (EOFError, OSError):
                if self._ended:
                    raise Cancelled from None
                raise self._gone() from None
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
                log.error("the simulation failed:\n%s", value)
                raise RuntimeError(value.strip().splitlines()[-1])

    def _gone(self) -> RobotError:
        self._process.join(_PATIENCE_S)
        return RobotError(
            f"the simulation's process has ended by itself (code {self._process.exitcode}), "
            "perhaps for lack of memory: simulate again, or use `nrdf simulate`"
        )


def _serve(pipe: Connection, job: Path, robot: Path | None, tool_frame: str | None) -> None:
    """In the process: simulate, then write whenever asked, until the other side is gone."""
    # As an exception, so that what is written half is removed.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        try:
            _simulate_and_write(pipe, job, robot, tool_frame)
        except NrdfError as error:
            pipe.send(("refused", error))
        except (EOFError, OSError):
            raise
        except Exception:
            pipe.send(("failed", traceback.format_exc()))


def _simulate_and_write(
    pipe: Connection, job: Path, robot: Path | None, tool_frame: str | None
) -> None:
    from nrdf.robot.arm import load_arm
    from nrdf.robot.simulate import read_work, simulate
    from nrdf.studio.playback import playback_of

    work = read_work(job)
    seen: list[str] = []

    def phase(what: str) -> None:
        # The phases of one tool path begin alike.
        seen.append(what.partition(":")[0])
        pipe.send(("phase", what))
        pipe.send(("progress", (len(set(seen)) - 1, 2 + len(work.job.paths))))

    simulated = simulate(work, load_arm(robot, tool_frame), progress=phase)
    pipe.send(("made", playback_of(simulated)))
    while True:
        order = pipe.recv()
        if order is None:
            continue  # cancelled when it was written already
        try:
            pipe.send(("made", _write(pipe, simulated, *order)))
        except Cancelled:
            pipe.send(("cancelled", None))
        except NrdfError as error:
            pipe.send(("refused", error))


def _write(
    pipe: Connection, simulated: Any, place: Path, title: str, origin: Mapping[str, Any]
) -> dict[str, Any]:
    from nrdf.output import output_folder
    from nrdf.robot.result import write_simulation

    def progress(done: int, total: int) -> None:
        if pipe.poll():
            pipe.recv()
            raise Cancelled
        pipe.send(("progress", (done, total)))

    with output_folder(place, overwrite=True) as folder:
        return write_simulation(folder, simulated, title, origin, progress=progress)
