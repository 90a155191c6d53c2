"""What `kill -9` costs a line."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from nrdf.serve.outbox import OBJECT


def kill_runs(cell_file: Path, inbox: Path, out: Path, kills: int, seed: int) -> dict[str, int]:
    """Kill `nrdf run` at random moments, at most `kills` times, then let it end; what was found.

    lost: objects without an outcome; twice: with more than one folder; halves: folders without
    their object.json, or unlike the store.
    """
    code = "import sys; from nrdf import cli; sys.exit(cli.run(sys.argv[1:]))"
    words = ["run", str(cell_file), str(inbox), "--out", str(out), "--once"]
    rng, done = np.random.default_rng(seed), 0
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    for _ in range(kills):
        process = subprocess.Popen([sys.executable, "-c", code, *words], **quiet)  # type: ignore[call-overload]
        try:
            process.wait(float(rng.uniform(2.0, 20.0)))
            break
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            done += 1
    subprocess.run([sys.executable, "-c", code, *words], check=False, **quiet)  # type: ignore[call-overload]
    return {"kills": done, **check_outbox(inbox, out)}


def check_outbox(inbox: Path, out: Path) -> dict[str, int]:
    """How many objects of an inbox are lost, done twice, or half written in an outbox."""
    folders = [p for outcome in ("done", "look-at", "refused") for p in (out / outcome).iterdir()]
    sources, halves = Counter(), 0  # type: ignore[var-annotated]
    for folder in folders:
        try:
            said = json.loads((folder / OBJECT).read_text("utf-8"))
        except (OSError, ValueError):
            halves += 1
            continue
        halves += said["outcome"] != folder.parent.name
        sources[Path(said["source"]).name] += 1
    names = [path.name for path in inbox.iterdir()]
    return {
        "objects": len(names),
        "lost": sum(name not in sources for name in names),
        "twice": sum(count - 1 for count in sources.values()),
        "halves": halves,
    }
