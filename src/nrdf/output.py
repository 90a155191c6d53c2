"""Output folders that appear whole or not at all."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nrdf.errors import OutputError

REPORT = "report.json"


@contextmanager
def output_folder(path: str | Path, overwrite: bool = False) -> Iterator[Path]:
    """A temporary folder beside `path` to write into, moved to `path` when the block ends well.

    Whatever ends the block early (an error, Ctrl-C), nothing stays behind, not even the parents
    that had to be made. With `overwrite` an existing folder keeps what is not ours: only files of
    the same names, and those that its earlier report.json lists, are replaced or removed.

    Raises OutputError if `path` is a file, is a folder that is not empty (without `overwrite`), or
    cannot be written.
    """
    path = Path(path)
    made: list[Path] = []
    temporary = path.absolute().parent / f".{path.absolute().name}.{os.getpid()}.tmp"
    try:
        _check(path, overwrite)
        made = _make_parents(temporary.parent)
        temporary.mkdir()
        yield temporary
        _move(temporary, path.absolute())
        made = []
    except OSError as error:
        raise OutputError(_message(path, error)) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        for parent in reversed(made):
            parent.rmdir()


def write_json(path: Path, content: Any) -> None:
    """Write JSON that a person can read; non-ASCII characters as they are."""
    text = json.dumps(content, indent=2, ensure_ascii=False, default=_plain)
    try:
        path.write_text(text + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(_message(path, error)) from error


def _plain(value: Any) -> Any:
    """NumPy numbers and arrays, paths and the like for JSON."""
    if hasattr(value, "tolist"):
        return value.tolist()
    return str(value)


def _check(path: Path, overwrite: bool) -> None:
    if path.exists() and not path.is_dir():
        raise OutputError(f"{path} is a file; --out needs a folder: give another name")
    if path.is_dir() and any(path.iterdir()) and not overwrite:
        raise OutputError(
            f"the folder {path} exists and is not empty; give another one, or --overwrite to "
            "replace an earlier result in it"
        )


def _make_parents(folder: Path) -> list[Path]:
    """Make `folder` and its parents; those that were missing, outermost first."""
    missing = [p for p in (folder, *folder.parents) if not p.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing[::-1]


def _move(temporary: Path, path: Path) -> None:
    if not path.exists():
        os.replace(temporary, path)
        return
    new = [p.relative_to(temporary) for p in sorted(temporary.rglob("*")) if p.is_file()]
    for name in _earlier_files(path):
        if name not in new:
            (path / name).unlink(missing_ok=True)
    for name in new:
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        os.replace(temporary / name, path / name)


def _earlier_files(path: Path) -> list[Path]:
    """Files in `path` that an earlier result's report lists, and that can be no others."""
    try:
        listed = json.loads((path / REPORT).read_text(encoding="utf-8"))["files"]
        names = [Path(name) for name in listed]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [name for name in names if not name.is_absolute() and ".." not in name.parts]


def _message(path: Path, error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"cannot write to {path}: {reason}; free some space or choose another --out"
