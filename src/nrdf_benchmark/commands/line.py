"""`nrdf eval line`: a line under load, killed, attacked, and how large a cluster may grow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from nrdf.commands.console import console, errors, show, table, versions
from nrdf.commands.options import File, Folder, Metavar
from nrdf.errors import ConfigError, OutputError
from nrdf.io.bounds import Count, NonNegativeCount, Seed


def line(
    out: Folder,
    data: Folder | None = None,
    cell: File | None = None,
    category: tuple[str, ...] = ("chair",),
    count: NonNegativeCount = 20,
    workers: tuple[Count, ...] = (1, 2),
    kills: NonNegativeCount = 0,
    requests: NonNegativeCount = 0,
    scale_out: Annotated[tuple[Count, Count], Metavar("OBJECTS WORKERS")] | None = None,
    seed: Seed = 0,
) -> None:
    """Measure a line: objects a minute, memory, what kills and attacks cost, a cluster.

    Objects are labelled meshes with the knowledge of --cell, or, without --data, small clouds of
    the package's chairs with one process, which cost 1 s each. Each number of workers takes all of
    them. With --kills, `nrdf run` and then `nrdf serve` are killed so often at random moments, and
    go on; with --requests a hostile client sends so many to `nrdf serve`. In both, workers only
    write: that is where something may break.

    Example: nrdf eval line --out results/ --count 200 --kills 100 --requests 20000

    Args:
        out: New folder for inbox, outboxes and line.json.
        data: Folder of labelled meshes (docs/evidence/bsrc.md).
        cell: Cell file with the knowledge of these objects.
        category: Kinds of object to take.
        count: Objects.
        workers: Numbers of worker processes to compare.
        kills: How often `nrdf run`, and `nrdf serve`, are killed.
        requests: Requests of the hostile client.
        scale_out: How many objects, on how many workers.
        seed: Of the stretching, the moments and the requests.
    """
    from nrdf.io.atomic import write_json
    from nrdf_benchmark.line.objects import write_light_cell, write_light_objects, write_meshes

    if out.exists():
        raise OutputError(f"{out} is there already; give a new folder")
    if (data is None) != (cell is None):
        raise ConfigError("give --data and --cell together, or neither")
    if scale_out and not count:
        raise ConfigError("--scale-out needs the times of some objects: give --count 10 or more")
    inbox = out / "inbox"
    if data is not None and cell is not None:
        write_meshes(inbox, data, category, count, seed)
    else:
        write_light_objects(inbox, count, seed)
        cell = write_light_cell(out)
    content: dict[str, Any] = {"versions": versions()}
    if count:
        content["speed"] = _speed(cell, inbox, out, workers)
    if kills:
        content["kills"] = _kills(cell, out, kills, seed)
    if requests:
        content["attack"] = _attack(cell, out, requests, seed)
    if scale_out:
        content["scale_out"] = _scale_out(out, content["speed"][0], *scale_out)
    write_json(out / "line.json", content)
    console.print(f"wrote {Path(out) / 'line.json'}")


def _speed(cell: Path, inbox: Path, out: Path, workers: tuple[int, ...]) -> list[dict[str, Any]]:
    from nrdf_benchmark.line.speed import measure_line

    shown = table(
        "", "workers", "objects", "a minute", "a core minute", "memory, MB", "growth, %",
        "done", "look-at", "refused",
    )  # fmt: skip
    found = []
    for number in workers:
        with errors.status(f"{number} workers"):
            speed = measure_line(cell, inbox, out / f"outbox-{number}", number)
        found.append(vars(speed))
        outcomes = [str(speed.outcomes.get(n, 0)) for n in ("done", "look-at", "refused")]
        shown.add_row(
            str(number), str(len(speed.cpu_s)), f"{speed.per_minute:.1f}",
            f"{speed.per_core_minute:.1f}", f"{max(speed.resident_mb):.0f}",
            f"{100 * speed.memory_growth:.1f}", *outcomes,
        )  # fmt: skip
    show(shown)
    return found


def _kills(cell: Path, out: Path, kills: int, seed: int) -> dict[str, dict[str, int]]:
    from nrdf_benchmark.line.kills import kill_runs, kill_services

    found = {}
    for name, kill in (("run", kill_runs), ("serve", kill_services)):
        with errors.status(f"killing nrdf {name}"):
            found[name] = kill(cell, out / f"killed-{name}", kills, seed)
        console.print(
            f"nrdf {name}: " + ", ".join(f"{what} {n}" for what, n in found[name].items())
        )
    return found


def _attack(cell: Path, out: Path, requests: int, seed: int) -> dict[str, Any]:
    from nrdf_benchmark.line.hostile import attack_service

    with errors.status("a hostile client"):
        found, after = attack_service(cell, out / "attacked", requests, seed)
    shown = table("", "attack", "requests", "answers")
    for kind, counts in sorted(found.answers.items()):
        answers = ", ".join(f"{status}: {n}" for status, n in sorted(counts.items()))
        shown.add_row(kind, str(sum(counts.values())), answers)
    show(shown)
    for one in found.wrong[:10]:
        console.print(one)
    console.print(
        f"{found.requests} requests, {len(found.wrong)} not answered with 4xx; after that: {after}"
    )
    return {"answers": found.answers, "wrong": found.wrong, "after": after}


def _scale_out(out: Path, speed: dict[str, Any], objects: int, workers: int) -> dict[str, Any]:
    from nrdf_benchmark.line.scale_out import draw_scale_out, limits, measure_overhead, simulate

    with errors.status("Dask's own time"):
        overhead = measure_overhead()
    seconds = speed["cpu_s"]
    mean = sum(seconds) / len(seconds)
    found = simulate(seconds, overhead.serial_s, objects, workers)
    console.print(
        f"Dask adds {1e3 * overhead.whole_s:.1f} ms to a task of {mean:.2f} s: "
        f"{overhead.whole_s / mean:.2%}; {1e3 * overhead.serial_s:.1f} ms of it in the scheduler's "
        f"process, which feeds {mean / overhead.serial_s:.0f} workers"
    )
    console.print(
        f"{objects:,} objects on {workers} workers: {found.hours:.1f} h; the scheduler is busy "
        f"{found.scheduler_busy:.1%} of it, workers {found.worker_busy:.1%}; {found.deaths} deaths"
    )
    shown = table("", "what", f"at {objects:,} objects", "then")
    folder = out / f"outbox-{speed['workers']}"
    jobs = [path for path in (folder / "done").iterdir()] or [folder]
    needs = limits(jobs, objects)
    for row in needs:
        shown.add_row(*row)
    show(shown)
    draw_scale_out(out / "scale-out.png", seconds, overhead.serial_s, objects)
    return {"overhead": vars(overhead), "simulated": vars(found), "limits": needs}
