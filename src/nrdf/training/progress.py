"""What a person sees of a training run: a bar in a terminal, log lines elsewhere, TensorBoard."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from nrdf.errors import OutputError
from nrdf.training.checkpoint import BOARD, METRICS

log = logging.getLogger(__name__)


class Display:
    """Reports the steps of one process's run; silent when `active` is False."""

    def __init__(self, run: Path, total: int, done: int, active: bool = True) -> None:
        self._active = active
        self._total = total
        self._started, self._first = time.monotonic(), done
        self._bar: Progress | None = None
        self._board: Any = None
        if not active:
            return
        self._run = run
        self._append("")  # fails now rather than after the first steps
        self._board = _tensorboard(run / BOARD, done)
        console = Console(stderr=True)
        if console.is_terminal:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[numbers]}"),
                TimeRemainingColumn(),
                console=console,
            )
            self._task = self._bar.add_task("training", total=total, completed=done, numbers="")

    def __enter__(self) -> Display:
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar:
            self._bar.stop()
        if self._board:
            with _written(self._run / BOARD):
                self._board.close()

    def report(self, stage: str, step: int, values: dict[str, float]) -> None:
        """Show scalars (losses, rates, validation figures) of step `step` of all steps."""
        if not self._active:
            return
        seconds = time.monotonic() - self._started
        each = seconds / max(1, step - self._first)
        left = each * (self._total - step)
        self._append(json.dumps({"step": step, "stage": stage, **values}) + "\n")
        if self._board:
            with _written(self._run / BOARD):
                for name, value in values.items():
                    self._board.add_scalar(name, value, step)
        numbers = "  ".join(f"{name.removeprefix('loss/')} {v:.4g}" for name, v in values.items())
        if self._bar:
            self._bar.update(self._task, completed=step, description=stage, numbers=numbers)
        else:
            log.info(
                "%s %d/%d  %s  %.2f s/step, %s left",
                stage,
                step,
                self._total,
                numbers,
                each,
                f"{left / 60:.0f} min" if left > 90 else f"{left:.0f} s",
            )

    def _append(self, text: str) -> None:
        path = self._run / METRICS
        with _written(path), path.open("a", encoding="utf-8") as file:
            file.write(text)


@contextmanager
def _written(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror}; free some space or allow writing, then "
            "start the same command again: it goes on from its last checkpoint"
        ) from None


def _tensorboard(folder: Path, step: int) -> Any:
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        log.info("no TensorBoard scalars; install nrdf[train] to get them")
        return None
    with _written(folder):
        return SummaryWriter(str(folder), purge_step=step + 1)
