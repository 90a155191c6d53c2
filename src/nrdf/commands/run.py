"""`nrdf run`: every object that arrives in a folder becomes a checked program."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table
from tyro.conf import Positional

from nrdf.commands.console import console, errors, table
from nrdf.commands.options import File, Folder, Metavar
from nrdf.io.bounds import Count

if TYPE_CHECKING:
    from nrdf.cell.work_cell import WorkCell
    from nrdf.serve.line import Line
    from nrdf.serve.store import ObjectRow

_POLL_S, _SUMMARY_S, _SHOWN = 0.2, 5.0, 12
STYLES = {"done": "green", "look-at": "yellow", "refused": "red"}


def run(
    cell: Positional[File],
    inbox: Positional[Annotated[Path, Metavar("INBOX")]],
    out: Folder = Path("outbox"),
    workers: Count | None = None,
    once: bool = False,
) -> int:
    """Make checked programs of all objects that arrive in a folder.

    A file counts when it has stopped growing; it stays where it is. Its knowledge file is the one
    that the cell file names for it. Good jobs go to OUT/done, doubtful ones to OUT/look-at, bad
    input to OUT/refused, each a folder with its reasons, report and programs. OUT/index.html shows
    all. Ends with Ctrl-C; the same command goes on, and nothing is lost or done twice, whatever
    ended it.

    With --once ends when nothing is left to do: with 3 where an object is to be looked at or was
    refused.

    Example: nrdf run cell.yaml inbox/ --out outbox/

    Args:
        cell: Cell file, as `nrdf cell new` begins it.
        inbox: Folder to watch, with the folders in it.
        out: Folder for the results, and for the store of what was done.
        workers: Worker processes; the cell's unless given.
        once: Take what is there, and end.
    """
    from nrdf.cell.file import read_cell
    from nrdf.errors import ConfigError, DataError
    from nrdf.serve.line import open_line

    described = read_cell(cell)
    if not described.knowledge:
        raise ConfigError(f"{cell} names no knowledge file: say under knowledge what is to be done")
    if not inbox.is_dir():
        raise DataError(f"the inbox {inbox} is no folder; make it, or name another")
    if out.resolve().is_relative_to(inbox.resolve()):
        raise ConfigError(f"--out {out} lies in the inbox, where results would count as objects")
    with open_line(described, cell, out, inbox, workers) as line, _shown(line) as show:
        line.on_end = show
        _drive(line, described, out, once)
        counts = line.store.counts()
    console.print(
        f"{counts['done']} done, {counts['look-at']} to look at, {counts['refused']} refused; "
        f"all in {out}; {out}/index.html shows them"
    )
    return 3 if once and counts["look-at"] + counts["refused"] else 0


def _drive(line: Line, cell: WorkCell, out: Path, once: bool) -> None:
    """Step the line until it is told to end."""
    from nrdf.serve.summary import write_summary

    ended = False

    def end(*_: object) -> None:
        nonlocal ended
        ended = True

    before = signal.signal(signal.SIGTERM, end)
    written, next_summary, passes = -1, 0.0, 0
    try:
        while not ended:
            line.step()
            passes += 1
            began = time.monotonic()
            if line.changed != written and began > next_summary:
                written = line.changed
                write_summary(out, line.store.rows(), cell.name, refresh_s=10)
                # After weeks there are many rows; they take a twentieth of the time at most.
                took = time.monotonic() - began
                next_summary = time.monotonic() + max(_SUMMARY_S, 19 * took)
            # The first pass only sees what is there.
            if once and passes > 1 and line.idle:
                break
            time.sleep(_POLL_S)
    except KeyboardInterrupt:
        errors.print("ended; the same command goes on")
    finally:
        signal.signal(signal.SIGTERM, before)
        write_summary(out, line.store.rows(), cell.name)


@contextmanager
def _shown(line: Line) -> Iterator[Callable[[ObjectRow], None]]:
    """A live table on a terminal, a line an object elsewhere; what to call when one has ended."""
    if not errors.is_terminal:
        yield _say
        return
    from rich.live import Live

    with Live(get_renderable=lambda: live_table(line), console=errors, refresh_per_second=4):
        yield lambda row: None


def _say(row: ObjectRow) -> None:
    with suppress(BrokenPipeError):
        seconds = row.seconds or 0.0
        what = f"{row.state:8} {row.name} ({seconds:.1f} s)"
        console.print(f"{what}: {row.reason}" if row.reason else what)


def live_table(line: Line) -> Table:
    """What is being worked on, what ended last, and how many there are of each."""
    counts = line.store.counts()
    title = ", ".join(f"{n} {state}" for state, n in counts.items())
    if line.paused:
        title += f"; paused: {line.paused}"
    shown = table(title, "object", "", "sure", "time, s", "reason", texts=2)
    for row in line.pool.busy:
        seconds = time.time() - (row.started_s or time.time())
        shown.add_row(row.name, "running", "", f"{seconds:.0f}", "")
    ended = [row for row in line.store.rows(most=4 * _SHOWN) if row.ended_s]
    for row in ended[:_SHOWN]:
        sure = row.figures.get("confidence")
        shown.add_row(
            row.name, row.state, "" if sure is None else f"{sure:.2f}",
            f"{row.seconds or 0:.0f}", row.reason, style=STYLES.get(row.state),
        )  # fmt: skip
    return shown
