"""`make fuzz`: the fuzz tests round after round, with new inputs in each, and what they found.

    python tools/fuzz.py [MINUTES] [PYTEST OPTIONS ...]

Without minutes it goes on until it is stopped (Ctrl-C). Ends with 1 if anything was found.
"""

from __future__ import annotations

import math
import secrets
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "tests" / "fuzz"


def main(words: list[str]) -> int:
    minutes, options = math.inf, words
    if words and words[0].replace(".", "", 1).isdigit():
        minutes, options = float(words[0]), words[1:]
    end = time.monotonic() + 60.0 * minutes
    found: dict[str, str] = {}
    rounds = 0
    try:
        while rounds == 0 or time.monotonic() < end:
            rounds += 1
            seed = secrets.randbelow(10**9)
            print(f"fuzz: round {rounds}, seed {seed}", flush=True)
            for line in play(seed, options, end - time.monotonic()):
                if line.startswith(("FAILED ", "ERROR ")):
                    name, _, why = line.partition(" - ")
                    found.setdefault(name, f"seed {seed}: {why}")
    except KeyboardInterrupt:
        pass
    print(f"fuzz: {rounds} rounds, {len(found)} tests found something")
    for name, why in found.items():
        print(f"  {name}\n    {why}")
    return int(bool(found))


def play(seed: int, options: list[str], seconds: float) -> list[str]:
    """One round's output, shown as it comes; after `seconds` the round is interrupted."""
    command = [
        *(sys.executable, "-m", "pytest", str(FOLDER), "-rfE", "--tb=short"),
        *("--hypothesis-profile=fuzz", f"--hypothesis-seed={seed}", *options),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    timer = threading.Timer(seconds, process.send_signal, [signal.SIGINT])
    if seconds < math.inf:
        timer.start()
    lines = []
    try:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="", flush=True)
            lines.append(line.rstrip("\n"))
        process.wait()
    finally:
        timer.cancel()
        process.terminate()
    if process.returncode < 0:
        lines.append(f"ERROR {FOLDER.name} - the process died of signal {-process.returncode}")
    return lines


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
