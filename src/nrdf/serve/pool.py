"""Worker processes with limits of time and memory; one that dies is started again."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from nrdf.errors import ProcessError
from nrdf.serve.store import ObjectRow

_START_S = 300.0  # until a worker says that it is ready: models are read from slow disks
_ENDED = object()


@dataclass(frozen=True)
class Answer:
    """What came of a task. content: the worker's answer; None where it died, for the reason."""

    row: ObjectRow
    work: Path
    content: dict[str, Any] | None
    reason: str = ""


@dataclass
class _Worker:
    process: subprocess.Popen[str]
    began: float
    lines: queue.SimpleQueue[Any] = field(default_factory=queue.SimpleQueue)
    ready: bool = False
    task: tuple[ObjectRow, Path] | None = None


class Pool:
    """`size` worker processes that run `command`. To be used by one thread."""

    def __init__(
        self, command: Sequence[str], size: int, time_limit_s: float, memory_limit_mb: int
    ) -> None:
        self.command = list(command)
        self.size = size
        self.time_limit_s, self.memory_limit_mb = time_limit_s, memory_limit_mb
        self.restarts = 0
        self._workers: list[_Worker] = []

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers:
            worker.process.kill()
            worker.process.wait()
        self._workers.clear()

    @property
    def free(self) -> int:
        """How many workers could take a task."""
        while len(self._workers) < self.size:
            self._workers.append(self._start())
        return sum(worker.ready and worker.task is None for worker in self._workers)

    @property
    def busy(self) -> list[ObjectRow]:
        """What is being worked on."""
        return [worker.task[0] for worker in self._workers if worker.task is not None]

    def resident_mb(self) -> float:
        """Memory of all workers, MB; 0 where the system does not tell."""
        return sum(resident_mb(worker.process.pid) or 0.0 for worker in self._workers)

    def submit(self, row: ObjectRow, work: Path) -> None:
        """Give an object to a free worker."""
        worker = next(w for w in self._workers if w.ready and w.task is None)
        worker.task, worker.began = (row, work), time.monotonic()
        line = json.dumps({"row": asdict(row), "work": str(work)})
        with suppress(OSError):  # it has just died, which `answers` notices
            assert worker.process.stdin is not None
            worker.process.stdin.write(line + "\n")
            worker.process.stdin.flush()

    def answers(self) -> list[Answer]:
        """What has come since the last call; ends workers beyond their limits.

        Raises ProcessError for workers that cannot start: what they say is wrong with the cell.
        """
        found: list[Answer] = []
        for worker in list(self._workers):
            fault = self._read(worker, found)
            if fault or (fault := self._beyond_limits(worker)):
                worker.process.kill()
                worker.process.wait()
                self._workers.remove(worker)
                self.restarts += 1
                if worker.task is not None:
                    found.append(Answer(*worker.task, None, fault))
                elif not worker.ready:
                    raise ProcessError(f"a worker cannot start: {fault}")
        return found

    def _start(self) -> _Worker:
        worker = _Worker(
            subprocess.Popen(
                self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                encoding="utf-8", env={**os.environ, **_one_thread(self.size)},
            ),
            time.monotonic(),
        )  # fmt: skip

        def read() -> None:
            assert worker.process.stdout is not None
            for line in worker.process.stdout:
                worker.lines.put(line)
            worker.lines.put(_ENDED)

        threading.Thread(target=read, daemon=True).start()
        return worker

    def _read(self, worker: _Worker, found: list[Answer]) -> str:
        """Take a worker's lines; why it has ended, "" where it has not."""
        with suppress(queue.Empty):
            while True:
                line = worker.lines.get_nowait()
                if line is _ENDED:
                    code = worker.process.wait()
                    how = f"signal {-code}" if code < 0 else f"exit code {code}"
                    return f"the worker process died ({how})"
                try:
                    content = json.loads(line)
                except ValueError:
                    return "the worker process said something that cannot be read"
                if "failed" in content:
                    raise ProcessError(content["failed"])
                if worker.task is None:
                    worker.ready = True
                else:
                    found.append(Answer(*worker.task, content))
                    worker.task = None
        return ""

    def _beyond_limits(self, worker: _Worker) -> str:
        seconds = time.monotonic() - worker.began
        if not worker.ready and seconds > _START_S:
            return f"it was not ready after {_START_S:g} s"
        if worker.task is None:
            return ""
        if seconds > self.time_limit_s:
            return f"it took longer than the time limit of {self.time_limit_s:g} s"
        if (resident_mb(worker.process.pid) or 0.0) > self.memory_limit_mb:
            return f"it needed more than the memory limit of {self.memory_limit_mb} MB"
        return ""


def worker_command(cell_file: Path) -> list[str]:
    """The command of a worker for a cell file."""
    return [sys.executable, "-m", "nrdf.serve.worker", str(cell_file.absolute())]


def resident_mb(pid: int) -> float | None:
    """Memory of a process, MB; None where the system does not tell."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, IndexError):
        return None


def _one_thread(size: int) -> dict[str, str]:
    """Several workers share the cores: each with one thread, unless the user says otherwise."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    return {name: os.environ.get(name, "1") for name in names} if size > 1 else {}
