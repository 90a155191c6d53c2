"""The outbox: a folder for each object, which appears whole, once, in the folder of its outcome."""

from __future__ import annotations

import json
import os
import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nrdf.errors import OutputError
from nrdf.io.atomic import output_errors, write_atomically, write_json
from nrdf.io.locks import random_token
from nrdf.serve.store import OUTCOMES, ObjectRow, Outcome

OBJECT = "object.json"
REASON = "reason.txt"
_WORK = ".work"


@dataclass(frozen=True)
class Outbox:
    """Folders `done`, `look-at` and `refused`, and a hidden one for work that is not done yet."""

    folder: Path

    def make(self) -> None:
        """Make its folders. Raises OutputError."""
        with output_errors(self.folder):
            for name in (*OUTCOMES, _WORK):
                (self.folder / name).mkdir(parents=True, exist_ok=True)

    def clear_work(self) -> None:
        """Remove what killed workers left."""
        for path in (self.folder / _WORK).iterdir():
            shutil.rmtree(path, ignore_errors=True)

    def new_work(self, row: ObjectRow) -> Path:
        """A path for an object's unfinished folder, which no other attempt has."""
        return self.folder / _WORK / f"{row.id}-{random_token()}"

    def place(self, name: str, outcome: str) -> Path:
        """Where an object's folder is once it has that outcome."""
        return self.folder / outcome / name

    def taken(self) -> set[str]:
        """Names of folders that are there, in lower case."""
        return {
            entry.name.casefold() for name in OUTCOMES for entry in os.scandir(self.folder / name)
        }

    def publish(self, work: Path, row: ObjectRow, outcome: Outcome) -> Path:
        """Move an object's finished folder to the folder of its outcome, in one step.

        Raises OutputError where that cannot be written, or holds one of that name.
        """
        place = self.place(row.name, outcome)
        with output_errors(place):
            if os.path.lexists(place):
                raise OutputError(f"{place} is there already; move it away")
            os.rename(work, place)
        return place

    def find(self, row: ObjectRow) -> tuple[Outcome, dict[str, Any]] | None:
        """The outcome of an object that was published before its row could say so."""
        for outcome in OUTCOMES:
            with suppress(OSError, ValueError):
                said = json.loads((self.place(row.name, outcome) / OBJECT).read_text("utf-8"))
                if (said["source"], said["bytes"], said["mtime_ns"]) == (
                    row.source, row.bytes, row.mtime_ns,
                ):  # fmt: skip
                    return outcome, said
        return None


def write_object(
    work: Path, row: ObjectRow, outcome: Outcome, reasons: list[str], figures: dict[str, Any]
) -> str:
    """Write what became of an object into its folder, in words and for programs; the one line.

    Raises OutputError.
    """
    with output_errors(work):
        work.mkdir(parents=True, exist_ok=True)
    reason = in_one_line(reasons)
    text = "\n".join(reasons or ["all limits are met"]) + "\n"
    write_atomically(work / REASON, [text.encode("utf-8", "replace")])
    said = {
        "id": row.id,
        "name": row.name,
        "source": row.source,
        "bytes": row.bytes,
        "mtime_ns": row.mtime_ns,
        "outcome": outcome,
        "reason": reason,
        "reasons": reasons,
        "figures": figures,
    }
    write_json(work / OBJECT, said)
    return reason


def in_one_line(reasons: list[str]) -> str:
    """The first of several reasons, and how many more there are."""
    if not reasons:
        return ""
    first = " ".join(reasons[0].split())
    return first if len(reasons) == 1 else f"{first} (and {len(reasons) - 1} more)"
