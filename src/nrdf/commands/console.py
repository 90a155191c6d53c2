"""What the verbs share: the terminal, progress bars, the words of a report."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console, JustifyMethod
from rich.table import Table

from nrdf.reports.origin import provenance as provenance
from nrdf.reports.origin import versions as versions

console = Console(highlight=False, markup=False, soft_wrap=True)
"""Results go to standard output. Paths are not broken, and brackets are no markup."""
errors = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
"""Progress, warnings and errors go to standard error."""


def table(title: str, *columns: str, texts: int = 1) -> Table:
    """A plain table; the first `texts` columns and those without a heading are text, the others
    numbers, with the unit that stands behind a comma in a heading below it."""
    made = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False)
    made.show_header = any(columns)
    for i, column in enumerate(columns):
        justify: JustifyMethod = "right" if i >= texts and column else "left"
        heading = column if i < texts else column.replace(", ", "\n")
        made.add_column(heading, justify=justify, header_style="dim")
    return made


def show(made: Table) -> None:
    """Print a table, its cells wrapped to the terminal."""
    console.print(made, soft_wrap=False)


class LogHandler(logging.Handler):
    """Log lines on `errors`, above any progress bar: warnings in colour, details dim."""

    STYLES = {logging.DEBUG: "dim", logging.INFO: ""}  # noqa: RUF012

    def emit(self, record: logging.LogRecord) -> None:
        style = self.STYLES.get(record.levelno, "yellow")
        origin = f"{record.name}: " if record.levelno == logging.DEBUG else ""
        errors.print(origin + self.format(record), style=style)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A callback (done, total) that draws a bar with the remaining time on a terminal."""
    with progress_bars([what]) as update:
        yield lambda done, total: update(what, done, total)


@contextmanager
def progress_bars(names: Sequence[str]) -> Iterator[Callable[[str, int, int], None]]:
    """A callback (name, done, total) that draws a bar a name on a terminal."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=errors,
        disable=not errors.is_terminal,
    ) as progress:
        tasks = {name: progress.add_task(name, total=None) for name in names}
        yield lambda name, done, total: progress.update(tasks[name], completed=done, total=total)


def command_line() -> str:
    """The command as it was typed."""
    import shlex

    return shlex.join(["nrdf", *sys.argv[1:]])


def write_report(folder: Path, report: dict[str, Any]) -> None:
    """Write report.json, with the time and the list of all files beside it."""
    from datetime import datetime, timezone

    from nrdf.io.atomic import write_json
    from nrdf.io.result_folder import REPORT

    files = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
    date = datetime.now(timezone.utc).isoformat(timespec="seconds")
    write_json(folder / REPORT, {"date": date, **report, "files": [*files, REPORT]})
