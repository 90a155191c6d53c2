"""The store of a line: one row an object, one outcome a row, whatever dies when.

SQLite in write-ahead mode. One process writes; others may read. Everything that is said of an
object is said in one transaction.
"""

from __future__ import annotations

import json
import re
import sqlite3
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from nrdf.errors import OutputError
from nrdf.io.file_names import WINDOWS_DEVICES

Outcome = Literal["done", "look-at", "refused"]
OUTCOMES: tuple[Outcome, ...] = ("done", "look-at", "refused")
STATES = ("waiting", "running", *OUTCOMES)
FILE = "line.sqlite"
_LONGEST_NAME = 80
_SCHEMA = """
CREATE TABLE IF NOT EXISTS objects (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  name TEXT NOT NULL UNIQUE COLLATE NOCASE,
  source TEXT NOT NULL, bytes INTEGER NOT NULL, mtime_ns INTEGER NOT NULL,
  label TEXT NOT NULL,
  state TEXT NOT NULL, reason TEXT NOT NULL DEFAULT '',
  attempts INTEGER NOT NULL DEFAULT 0,
  arrived_s REAL NOT NULL, started_s REAL, ended_s REAL,
  figures TEXT NOT NULL DEFAULT '{}',
  UNIQUE (source, bytes, mtime_ns)
);
CREATE INDEX IF NOT EXISTS by_state ON objects (state, id);
"""
_COLUMNS = (
    "id, name, source, bytes, mtime_ns, label, state, reason, attempts, arrived_s, started_s, "
    "ended_s, figures"
)


@dataclass(frozen=True)
class ObjectRow:
    """An object and what became of it.

    name: of its folder; source: its file, as it was at bytes and mtime_ns; label: its name as seen
    from the inbox. attempts: how often a worker began it. figures: confidence, coverage, cycle
    time, ... of its job.
    """

    id: int
    name: str
    source: str
    bytes: int
    mtime_ns: int
    label: str
    state: str
    reason: str = ""
    attempts: int = 0
    arrived_s: float = 0.0
    started_s: float | None = None
    ended_s: float | None = None
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seconds(self) -> float | None:
        """Time from when it began to when it ended."""
        return None if None in (self.started_s, self.ended_s) else self.ended_s - self.started_s  # type: ignore[operator]


class Store:
    """The rows of a line, in `folder`. Usable from several threads of one process."""

    def __init__(self, folder: Path) -> None:
        self._lock = threading.RLock()
        self.path = folder / FILE
        with self._errors():
            self._db = sqlite3.connect(self.path, timeout=30.0, check_same_thread=False)
            self._db.isolation_level = None
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = FULL")
            self._db.executescript(_SCHEMA)

    def close(self) -> None:
        with self._lock:
            self._db.close()

    def add(self, source: str, size: int, mtime_ns: int, label: str, taken: set[str]) -> int | None:
        """A new row, waiting; its id. None where this very file has one.

        taken: names, in lower case, that no new row may have.
        """
        with self._transaction() as db:
            known = db.execute(
                "SELECT 1 FROM objects WHERE source = ? AND bytes = ? AND mtime_ns = ?",
                (source, size, mtime_ns),
            ).fetchone()
            if known:
                return None
            stem, name, number = safe_name(label), safe_name(label), 1
            while (
                name.casefold() in taken
                or db.execute("SELECT 1 FROM objects WHERE name = ?", (name,)).fetchone()
            ):
                number += 1
                name = f"{stem}-{number}"
            cursor = db.execute(
                "INSERT INTO objects (name, source, bytes, mtime_ns, label, state, arrived_s) "
                "VALUES (?, ?, ?, ?, ?, 'waiting', ?)",
                (name, source, size, mtime_ns, label, time.time()),
            )
            return int(cursor.lastrowid or 0)

    def find(self, source: str, size: int, mtime_ns: int) -> ObjectRow | None:
        """The row of this very file; None where it has none."""
        rows = self._rows("WHERE source = ? AND bytes = ? AND mtime_ns = ?", source, size, mtime_ns)
        return next(iter(rows), None)

    def claim(self) -> ObjectRow | None:
        """The object that waits longest, running from now on; None where none waits."""
        with self._transaction() as db:
            found = db.execute(
                "SELECT id FROM objects WHERE state = 'waiting' ORDER BY attempts, id LIMIT 1"
            ).fetchone()
            if found is None:
                return None
            db.execute(
                "UPDATE objects SET state = 'running', started_s = ?, attempts = attempts + 1 "
                "WHERE id = ?",
                (time.time(), found[0]),
            )
        return self.row(found[0])

    def wait_again(self, id: int, reason: str, counts: bool = True) -> None:
        """Put a running object back; counts: the attempt was its own fault, or may have been."""
        with self._transaction() as db:
            db.execute(
                "UPDATE objects SET state = 'waiting', reason = ?, attempts = attempts - ? "
                "WHERE id = ? AND state = 'running'",
                (reason, 0 if counts else 1, id),
            )

    def finish(self, id: int, outcome: Outcome, reason: str, figures: Mapping[str, Any]) -> None:
        """Give a running object its outcome. Nothing happens where it has one."""
        with self._transaction() as db:
            db.execute(
                "UPDATE objects SET state = ?, reason = ?, figures = ?, ended_s = ? "
                "WHERE id = ? AND state IN ('running', 'waiting')",
                (outcome, reason, json.dumps(figures), time.time(), id),
            )

    def row(self, id: int) -> ObjectRow | None:
        """The object of that id; None where there is none."""
        return next(iter(self._rows("WHERE id = ?", id)), None)

    def rows(self, state: str | None = None, most: int = -1) -> list[ObjectRow]:
        """All objects, or those in a state, the latest first; at most so many."""
        if state is None:
            return self._rows("ORDER BY id DESC LIMIT ?", most)
        return self._rows("WHERE state = ? ORDER BY id DESC LIMIT ?", state, most)

    def open_sources(self) -> set[str]:
        """The files of all objects that have no outcome yet."""
        with self._lock, self._errors():
            found = self._db.execute(
                "SELECT source FROM objects WHERE state IN ('waiting', 'running')"
            ).fetchall()
        return {source for (source,) in found}

    def counts(self) -> dict[str, int]:
        """How many objects are in each state."""
        with self._lock, self._errors():
            found = dict(self._db.execute("SELECT state, COUNT(*) FROM objects GROUP BY state"))
        return {state: found.get(state, 0) for state in STATES}

    def place(self, row: ObjectRow) -> int:
        """How many waiting objects are before this one."""
        with self._lock, self._errors():
            found = self._db.execute(
                "SELECT COUNT(*) FROM objects WHERE state = 'waiting' AND (attempts, id) < (?, ?)",
                (row.attempts, row.id),
            ).fetchone()
        return int(found[0])

    def _rows(self, where: str, *values: Any) -> list[ObjectRow]:
        with self._lock, self._errors():
            found = self._db.execute(f"SELECT {_COLUMNS} FROM objects {where}", values).fetchall()
        names = _COLUMNS.split(", ")
        said = (dict(zip(names, row, strict=True)) for row in found)
        return [ObjectRow(**{**row, "figures": json.loads(row["figures"])}) for row in said]

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        with self._lock, self._errors():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield self._db
                self._db.execute("COMMIT")
            except BaseException:
                with suppress(sqlite3.Error):
                    self._db.execute("ROLLBACK")
                raise

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise OutputError(
                f"cannot use the store {self.path}: {error}; what it says stays as it was"
            ) from error


def safe_name(label: str) -> str:
    """A folder's name for an object's file, that every file system takes."""
    stem = Path(label.replace("\\", "/")).stem
    name = re.sub(r"[^\w.-]+", "_", stem).strip("._")[:_LONGEST_NAME] or "object"
    return f"{name}_" if name.lower() in WINDOWS_DEVICES else name
