"""`nrdf run` and `nrdf serve` with workers that only write: all that `kill -9` may break, often.

    python -m nrdf_benchmark.line.light_worker run cell.yaml inbox/ --out outbox/

A worker of the real kind needs seconds to load its models; of a hundred kills most would meet that.
Store, outbox, watcher, pool and service are the real ones.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

from nrdf.serve.outbox import write_object
from nrdf.serve.store import ObjectRow
from nrdf.serve.work import PROGRAMS

_WORK_S = 0.05
_FILES, _BYTES = 8, 50_000


def judge(row: ObjectRow, work: Path) -> dict[str, Any]:
    """Write a folder of some files, as a job has them; every fifth object is to be looked at."""
    work.mkdir(parents=True)
    for number in range(_FILES):
        (work / f"{number}.bin").write_bytes(bytes([number]) * _BYTES)
        time.sleep(_WORK_S / _FILES)
    (work / PROGRAMS).mkdir()
    (work / PROGRAMS / "light.json").write_text("{}")
    outcome, reasons = ("look-at", ["it is a fifth"]) if row.id % 5 == 0 else ("done", [])
    figures = {"confidence": 0.5, "coverage": 0.9}
    reason = write_object(work, row, outcome, reasons, figures)  # type: ignore[arg-type]
    return {"outcome": outcome, "reason": reason, "figures": figures, "again": False}


def main(words: list[str]) -> int:
    """A command of nrdf with such workers, or (as "worker") one of them."""
    if words[0] == "worker":
        from nrdf.serve.worker import serve_parent

        serve_parent(judge)
        return 0
    from nrdf import cli
    from nrdf.serve import line

    command = [sys.executable, "-m", "nrdf_benchmark.line.light_worker", "worker"]
    line.worker_command = lambda cell_file: command
    return cli.run(words)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
