"""What `kill -9` costs `nrdf run` and `nrdf serve` at random moments under load."""

from __future__ import annotations

import json
import socket
import threading
import time
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np

from nrdf.serve.outbox import OBJECT
from nrdf.serve.store import OUTCOMES
from nrdf_benchmark.line.light_worker import start

_OBJECTS_A_KILL = 16
_SHORTEST_S, _LONGEST_S = 0.2, 2.0
"""From the first sign of work of a process to its end."""
_START_S, _END_S, _ASK_S = 120.0, 300.0, 5.0


def kill_runs(cell: Path, folder: Path, kills: int, seed: int) -> dict[str, int]:
    """Kill `nrdf run` with light workers so often while it works, then let it end."""
    inbox, out = folder / "inbox", folder / "outbox"
    inbox.mkdir(parents=True)
    for number in range(_OBJECTS_A_KILL * kills):
        (inbox / f"{number:05}.csv").write_text(f"{number}\n")
    words = ["run", str(cell), str(inbox), "--out", str(out), "--workers", "1", "--once"]
    rng, done = np.random.default_rng(seed), 0
    for _ in range(kills):
        before = published(out)
        process = start(words)
        wait_until(partial(_worked, process, out, before))
        time.sleep(rng.uniform(0.0, _LONGEST_S))
        done += process.is_alive()
        process.kill()
        process.join()
    start(words).join()
    return {"kills": done, **check_outbox([path.name for path in inbox.iterdir()], out)}


def kill_services(cell: Path, folder: Path, kills: int, seed: int) -> dict[str, int]:
    """Kill `nrdf serve` with light workers so often while files are sent; then let it end.

    A file without an answer is sent again, with the same Idempotency-Key.
    """
    out, rng, sent, done = folder / "outbox", np.random.default_rng(seed), 0, 0
    folder.mkdir(parents=True)
    port = free_port()
    for _ in range(kills):
        with serving(cell, out, port) as url:
            killer = threading.Timer(rng.uniform(_SHORTEST_S, _LONGEST_S), url.process.kill)
            killer.start()
            while url.process.is_alive():
                sent += _send(url, sent)
            done += 1
    names = [f"{number:05}.csv" for number in range(sent)]
    with serving(cell, out, port):
        wait_until(lambda: not check_outbox(names, out)["lost"], _END_S)
    return {"kills": done, **check_outbox(names, out)}


def _worked(process: BaseProcess, out: Path, before: int) -> bool:
    return published(out) > before or not process.is_alive()


class Url(str):
    """A server's address, with its process."""

    process: BaseProcess


@contextmanager
def serving(cell: Path, out: Path, port: int, *more: str) -> Iterator[Url]:
    """`nrdf serve` with a light worker, which answers; ended with the block."""
    words = ["serve", str(cell), "--out", str(out), "--workers", "1", "--port", str(port)]
    url = Url(f"http://127.0.0.1:{port}")
    url.process = start([*words, *more])
    try:
        wait_until(lambda: _answers(f"{url}/healthz"))
        yield url
    finally:
        url.process.terminate()
        url.process.join()


def free_port() -> int:
    """A port of this machine that nothing listens on."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def published(out: Path) -> int:
    """How many folders there are in an outbox."""
    places = (out / outcome for outcome in OUTCOMES)
    return sum(1 for place in places if place.is_dir() for _ in place.iterdir())


def check_outbox(names: Sequence[str], out: Path) -> dict[str, int]:
    """How many of the named files are lost, done twice, or half written in an outbox.

    lost: without an outcome; twice: with more than one folder; halves: folders without their
    object.json, or of another outcome than it says, and parts of files.
    """
    folders = [p for outcome in OUTCOMES for p in (out / outcome).iterdir()]
    sources: Counter[str] = Counter()
    halves = sum(1 for outcome in OUTCOMES for _ in (out / outcome).rglob("*.part"))
    for folder in folders:
        try:
            said = json.loads((folder / OBJECT).read_text("utf-8"))
        except (OSError, ValueError):
            halves += 1
            continue
        halves += said["outcome"] != folder.parent.name
        sources[Path(said["source"]).name] += 1
    return {
        "objects": len(names),
        "lost": sum(name not in sources for name in names),
        "twice": sum(count - 1 for count in sources.values()),
        "halves": halves,
    }


def wait_until(until: Callable[[], bool], seconds: float = _START_S) -> None:
    end = time.monotonic() + seconds
    while not until() and time.monotonic() < end:
        time.sleep(0.02)


def _answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=_ASK_S) as answer:
            return bool(answer.status == 200)
    except OSError:
        return False


def _send(url: str, number: int) -> bool:
    """Send an object; whether the service said that it has it."""
    request = urllib.request.Request(
        f"{url}/jobs?name={number:05}.csv", f"{number}\n".encode(),
        {"Idempotency-Key": f"object {number}", "Content-Type": "text/csv"},
    )  # fmt: skip
    try:
        with urllib.request.urlopen(request, timeout=_ASK_S) as answer:
            return bool(answer.status == 202)
    except (OSError, ValueError):
        return False
