"""`nrdf eval line`: how many objects a minute a line takes, its memory, and `kill -9`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nrdf.commands.console import console, errors, show, table, versions
from nrdf.commands.options import File, Folder
from nrdf.io.bounds import Count, NonNegativeCount, Seed


def line(
    data: Folder,
    cell: File,
    out: Folder,
    category: tuple[str, ...] = ("chair",),
    count: Count = 20,
    workers: tuple[Count, ...] = (1, 2),
    kills: NonNegativeCount = 0,
    seed: Seed = 0,
) -> None:
    """Measure a line: objects a minute, memory, and what is lost where it is killed.

    Objects are labelled meshes, stretched at random. Each number of workers takes all of them;
    then, with --kills, `nrdf run` is killed at random moments and goes on.

    Example: nrdf eval line --data objects/ikea --cell cell.yaml --out results/ --count 200

    Args:
        data: Folder of labelled meshes (docs/evidence/bsrc.md).
        cell: Cell file with the knowledge of these objects.
        out: New folder for inbox, outboxes and line.json.
        category: Kinds of object to take.
        count: Objects.
        workers: Numbers of worker processes to compare.
        kills: How often `nrdf run` is killed, at most.
        seed: Of the stretching and of the moments.
    """
    from nrdf.errors import OutputError
    from nrdf.io.atomic import write_json
    from nrdf_benchmark.line.kills import kill_runs
    from nrdf_benchmark.line.objects import write_meshes
    from nrdf_benchmark.line.speed import measure_line

    if out.exists():
        raise OutputError(f"{out} is there already; give a new folder")
    inbox = out / "inbox"
    write_meshes(inbox, data, list(category), count, seed)
    shown = table(
        "", "workers", "objects", "a minute", "a core minute", "memory, MB", "growth, %",
        "done", "look-at", "refused",
    )  # fmt: skip
    found = []
    for number in workers:
        with errors.status(f"{number} workers"):
            speed = measure_line(cell, inbox, out / f"outbox-{number}", number)
        found.append(speed)
        outcomes = [str(speed.outcomes.get(n, 0)) for n in ("done", "look-at", "refused")]
        shown.add_row(
            str(number), str(len(speed.cpu_s)), f"{speed.per_minute:.1f}",
            f"{speed.per_core_minute:.1f}", f"{max(speed.resident_mb):.0f}",
            f"{100 * speed.memory_growth:.1f}", *outcomes,
        )  # fmt: skip
    show(shown)
    content: dict[str, Any] = {"versions": versions(), "speed": [vars(speed) for speed in found]}
    if kills:
        with errors.status("killing"):
            lost = kill_runs(cell, inbox, out / "outbox-killed", kills, seed)
        content["kills"] = lost
        console.print(", ".join(f"{name} {n}" for name, n in lost.items()))
    write_json(out / "line.json", content)
    console.print(f"wrote {Path(out) / 'line.json'}")
