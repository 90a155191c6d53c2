"""Files that are written whole or not at all, and what to say where that fails."""

from __future__ import annotations

import errno
import json
import os
import secrets
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from nrdf.errors import OutputError

_ADVICE = {
    errno.ENOSPC: "free some space or choose another place",
    errno.EDQUOT: "free some space or choose another place",
    errno.EFBIG: "choose a place that takes larger files",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EACCES: "allow writing there or choose another place",
    errno.EPERM: "allow writing there or choose another place",
    errno.EROFS: "it can only be read there: choose another place",
}


def write_atomically(path: Path, parts: list[bytes | memoryview]) -> None:
    """Write `parts` one after another to `path` so that it holds all of them or stays as it was.

    Raises OutputError if the folder is missing, not writable or full.
    """
    # The name is known before the file exists, so that an interrupt removes it too.
    temporary = path.parent / f".{path.name}.{secrets.token_hex(4)}.part"
    try:
        with open(temporary, "xb") as file:
            for part in parts:
                file.write(part)
        os.replace(temporary, path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_json(path: Path, content: Any) -> None:
    """Write JSON that a person can read, whole or not at all; non-ASCII characters as they are.

    Raises OutputError if it cannot be written.
    """
    text = json.dumps(content, indent=2, ensure_ascii=False, default=_plain)
    write_atomically(path, [f"{text}\n".encode("utf-8", "surrogateescape")])


def _plain(value: Any) -> Any:
    """NumPy numbers and arrays, paths and the like for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


@contextmanager
def output_errors(path: str | Path) -> Iterator[None]:
    """Raise errors of writing `path` within the block as OutputError."""
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        raise cannot_write(path, error) from error


def cannot_write(path: str | Path, error: Exception) -> OutputError:
    """The OutputError that says why `path` cannot be written, and what to do."""
    code = getattr(error, "errno", None)
    reason = getattr(error, "strerror", None) or str(error)
    advice = _ADVICE.get(code or 0, "choose another place, or free some space")
    return OutputError(f"cannot write {path}: {reason}; {advice}")
