"""`nrdf run` and `nrdf serve` with workers that only write: all that `kill -9` may break, often.

A worker of the real kind needs seconds to load its models; of a hundred kills most would meet that.
Store, outbox, watcher, pool and service are the real ones. Processes are forked from one that has
imported them.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from nrdf.serve.outbox import write_object
from nrdf.serve.store import ObjectRow
from nrdf.serve.worker import serve_parent

_WORK_S = 0.05
_FILES, _BYTES = 8, 50_000
_IMPORTED = (
    "nrdf.commands.run", "nrdf.commands.serve", "nrdf.serve.line", "nrdf.serve.summary",
    "nrdf.cell.file", "nrdf.serve.connections", "nrdf.serve.service",
)  # fmt: skip


def judge(row: ObjectRow, work: Path) -> dict[str, Any]:
    """Write a folder of some files, as a job has them; every fifth object is to be looked at."""
    work.mkdir(parents=True)
    for number in range(_FILES):
        (work / f"{number}.bin").write_bytes(bytes([number]) * _BYTES)
        time.sleep(_WORK_S / _FILES)
    (work / "programs").mkdir()
    (work / "programs" / "light.json").write_text("{}")
    outcome, reasons = ("look-at", ["it is a fifth"]) if row.id % 5 == 0 else ("done", [])
    figures = {"confidence": 0.5, "coverage": 0.9}
    reason = write_object(work, row, outcome, reasons, figures)  # type: ignore[arg-type]
    return {"outcome": outcome, "reason": reason, "figures": figures, "again": False}


def start(words: Sequence[str]) -> BaseProcess:
    """Start a command of nrdf with such workers; what it says is lost."""
    context = get_context("forkserver")
    context.set_forkserver_preload(list(_IMPORTED))
    process = context.Process(target=_run, args=(list(words),), daemon=True)
    process.start()
    return process


def _run(words: list[str]) -> None:
    from nrdf import cli
    from nrdf.serve import line

    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    line.worker_command = lambda cell_file: [sys.executable, "-m", __name__]
    sys.exit(cli.run(words))


if __name__ == "__main__":
    serve_parent(judge)
