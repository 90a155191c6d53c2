"""A line whose workers do nothing but write, as a process of its own that tests may kill.

python -m builders.line_process OUT INBOX SECONDS_AN_OBJECT
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

from nrdf.serve.line import Line
from nrdf.serve.outbox import Outbox, write_object
from nrdf.serve.pool import Pool
from nrdf.serve.store import ObjectRow, Store
from nrdf.serve.watch import Watcher

WORKER = [sys.executable, "-m", "builders.line_process", "worker"]


def judge(row: ObjectRow, work: Path) -> dict[str, Any]:
    """What an object's own text says: sleep N, die, grow N (MB), full (a disk), bad, doubtful."""
    word, _, value = Path(row.source).read_text().partition(" ")
    if word == "sleep":
        time.sleep(float(value))
    elif word == "die":
        os.kill(os.getpid(), 9)
    elif word == "grow":
        held = bytearray(os.urandom(1 << 20)) * int(value)
        time.sleep(30)
        del held
    elif word == "full":
        return {"outcome": "refused", "reason": "no space", "figures": {}, "again": True}
    outcome = {"bad": "refused", "doubtful": "look-at"}.get(word, "done")
    reasons = [] if outcome == "done" else [f"it is {word}"]
    figures = {} if word == "bad" else {"paths": 1, "confidence": 0.5, "coverage": 0.9}
    (work / "job").mkdir(parents=True)
    (work / "job" / "toolpaths.json").write_text("x" * 100_000)
    reason = write_object(work, row, outcome, reasons, figures)  # type: ignore[arg-type]
    return {"outcome": outcome, "reason": reason, "figures": figures, "again": False}


def line_in(out: Path, inbox: Path | None, size: int = 2, seconds=20.0, memory_mb=4000) -> Line:
    """A line with such workers; its store and pool are the caller's to close."""
    outbox = Outbox(out)
    outbox.make()
    watcher = None if inbox is None else Watcher(inbox, 0.05)
    return Line(outbox, Store(out), Pool(WORKER, size, seconds, memory_mb), watcher)


def environment() -> dict[str, str]:
    """The environment of a process that finds this module."""
    here = str(Path(__file__).parents[1])
    return {**os.environ, "PYTHONPATH": os.pathsep.join([here, os.environ.get("PYTHONPATH", "")])}


def main(words: list[str]) -> None:
    if words[0] == "worker":
        from nrdf.serve import worker

        worker.serve_parent(judge)
        return
    line = line_in(Path(words[0]), Path(words[1]))
    with line.pool:
        line.recover()
        while True:
            line.step()
            time.sleep(0.01)


if __name__ == "__main__":
    main(sys.argv[1:])
