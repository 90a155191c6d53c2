"""The table of a line's objects: a page with thumbnails, CSV, Parquet; the most doubtful first."""

from __future__ import annotations

import csv
import io
import json
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from nrdf.io.atomic import write_atomically
from nrdf.io.file_names import spreadsheet_text
from nrdf.io.result_folder import REPORT
from nrdf.reports.html import duration_in_words, write_html
from nrdf.reports.job_folder import HTML_REPORT, PICTURE
from nrdf.serve.many import TransferOutcome
from nrdf.serve.outbox import REASON, in_one_line
from nrdf.serve.store import STATES, ObjectRow

PAGE, TABLE, PARQUET = "index.html", "objects.csv", "objects.parquet"
MOST_SHOWN = 2000
"""Rows of a page, which a browser must lay out; the tables have all."""
MOST_DOUBTFUL = 10
COLUMNS = (
    *("id", "name", "source", "state", "reason", "category", "confidence", "coverage", "paths"),
    *("skipped", "cycle_time_s", "warnings", "reached", "cpu_s", "attempts", "arrived", "seconds"),
)
_KINDS: dict[str, type] = {
    **dict.fromkeys(("name", "source", "state", "reason", "category", "arrived"), str),
    **dict.fromkeys(("id", "paths", "skipped", "warnings", "attempts"), int),
}
"""Of columns in Parquet; all others are numbers."""


def doubtful_first(rows: Sequence[ObjectRow]) -> list[ObjectRow]:
    """Objects with a job, those to look at first, then by confidence and coverage, least first."""
    judged = [row for row in rows if row.state in ("done", "look-at")]
    return sorted(
        judged,
        key=lambda row: (
            row.state == "done",
            row.figures.get("confidence", 0.0),
            row.figures.get("coverage", 0.0),
        ),
    )


def table_rows(rows: Sequence[ObjectRow]) -> Iterator[dict[str, Any]]:
    """What the table has of each object, by column; None where there is nothing to say."""
    for row in rows:
        arrived = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(row.arrived_s))
        said = {"id": row.id, "name": row.name, "source": row.source, "state": row.state,
                "reason": row.reason, "attempts": row.attempts, "arrived": arrived,
                "seconds": None if row.seconds is None else round(row.seconds, 2)}  # fmt: skip
        yield {name: said.get(name, row.figures.get(name)) for name in COLUMNS}


def csv_text(rows: Sequence[ObjectRow]) -> str:
    """The table as CSV; no cell is a spreadsheet's formula."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for row in table_rows(rows):
        writer.writerow(
            {k: spreadsheet_text(v) if isinstance(v, str) else v for k, v in row.items()}
        )
    return text.getvalue()


def write_summary(out: Path, rows: Sequence[ObjectRow], name: str, refresh_s: int = 0) -> None:
    """Write the page and the table of all objects into an outbox. Raises OutputError.

    name: the cell's. refresh_s: after how long a browser loads the page again; 0: never.
    """
    write_tables(out, rows)
    write_html(out / PAGE, "line.html", page_content(rows, name, refresh_s))


def write_tables(out: Path, rows: Sequence[ObjectRow]) -> None:
    """Write the table as CSV and, where pyarrow is installed, as Parquet. Raises OutputError."""
    write_atomically(out / TABLE, [csv_text(rows).encode()])
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        return
    kinds = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64()}
    schema = pyarrow.schema([(name, kinds[_KINDS.get(name, float)]) for name in COLUMNS])
    content = io.BytesIO()
    parquet.write_table(pyarrow.Table.from_pylist(list(table_rows(rows)), schema), content)
    write_atomically(out / PARQUET, [content.getbuffer()])


def write_catalogue(out: Path, outcomes: Sequence[TransferOutcome], name: str) -> None:
    """The same page and table of jobs that stand side by side in `out`. Raises OutputError."""
    states = {0: "done", 3: "look-at", 4: "look-at"}
    rows = []
    for number, one in enumerate(outcomes, start=1):
        figures: dict[str, Any] = {}
        with suppress(OSError, ValueError, KeyError):
            figures = figures_of(json.loads((one.folder / REPORT).read_text("utf-8")))
        state = states.get(one.exit_code, "refused")
        label, source = one.target.name, str(one.target)
        reason = in_one_line(list(one.reasons))
        rows.append(ObjectRow(number, one.folder.name, source, 0, 0, label, state, reason, 1,
                              time.time(), None, time.time(), figures))  # fmt: skip
    write_tables(out, rows)
    content = page_content(rows, name)
    for shown in [*content["rows"], *content["doubtful"]]:
        for key in ("report", "picture"):
            shown[key] = shown[key].removeprefix(f"{shown['state']}/")
    for shown in content["rows"]:
        if shown["state"] == "refused":
            shown["report"] = ""  # there is no folder
    write_html(out / PAGE, "line.html", content)


def figures_of(report: dict[str, Any]) -> dict[str, Any]:
    """What tables say of a job: the least confidence and coverage, paths, cycle time, warnings."""
    found = [region["confidence"] for region in report["regions"].values() if region["found"]]
    planned = [path["metrics"] for path in report["paths"] if path["planned"]]
    return {
        "category": report.get("category", ""),
        "confidence": round(min(found, default=0.0), 4),
        "coverage": round(min((m["coverage"] for m in planned), default=0.0), 4),
        "paths": report["total"]["paths"],
        "skipped": report["total"]["skipped"],
        "cycle_time_s": round(report["total"]["cycle_time_s"], 1),
        "warnings": len(report["warnings"]),
    }


def page_content(
    rows: Sequence[ObjectRow],
    name: str,
    refresh_s: int = 0,
    at: str = "",
    counts: Mapping[str, int] | None = None,
) -> dict[str, Any]:
    """What the page's template is filled with.

    at: where the objects' folders are, as a link. counts: of all objects by state, where `rows` are
    not all.
    """
    doubtful = doubtful_first(rows)[:MOST_DOUBTFUL]
    if counts is None:
        found = Counter(row.state for row in rows)
        counts = {state: found[state] for state in STATES}
    return {
        "total": sum(counts.values()),
        "name": name,
        "refresh_s": refresh_s,
        "counts": counts,
        "doubtful": [_shown(row, at) for row in doubtful],
        "rows": [_shown(row, at) for row in rows[:MOST_SHOWN]],
    }


def _shown(row: ObjectRow, at: str) -> dict[str, Any]:
    """An object as the page shows it."""
    folder = f"{at}{row.state}/{row.name}"
    has_job = "paths" in row.figures
    figures = row.figures
    share = {n: f"{figures[n]:.0%}" if n in figures else "–" for n in ("confidence", "coverage")}
    seconds = figures.get("cycle_time_s")
    return {
        "name": row.name,
        "state": row.state,
        "reason": row.reason,
        "report": f"{folder}/{HTML_REPORT if has_job else REASON}" if row.ended_s else "",
        "picture": f"{folder}/{PICTURE}" if has_job and row.ended_s else "",
        **share,
        "paths": figures.get("paths", "–"),
        "cycle_time": "–" if seconds is None else duration_in_words(seconds),
        "cycle_time_s": seconds or 0.0,
        "warnings": figures.get("warnings", "–"),
    }
