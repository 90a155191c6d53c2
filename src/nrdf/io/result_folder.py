"""Replacing a result's folder by a new one without losing files that nrdf did not write.

A result's folder holds MANIFEST, the list of its own files with sizes and checksums. A file is
removed only if it is still exactly what that list says. All other files are foreign: they stay, or
are renamed to NAME.kept where the new result has a file of that name. Links are not followed.
"""

from __future__ import annotations

import json
import logging
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from nrdf.errors import OutputError
from nrdf.io.atomic import write_atomically
from nrdf.io.files import read_file, sha256_of
from nrdf.io.locks import hidden_path, leftover_folders, lock_folder

log = logging.getLogger(__name__)

MANIFEST = ".nrdf-files.json"
REPORT = "report.json"
_LARGEST_MANIFEST = 1 << 26


class _Entry(NamedTuple):
    """A file of a result: its name in the folder, with / between parts."""

    name: str
    bytes: int
    sha256: str


def write_manifest(folder: Path) -> None:
    """Write the list of all files in `folder`. Raises OutputError."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    _write_manifest(
        folder, {_file_entry(path, path.relative_to(folder).as_posix()) for path in files}
    )


def replace_folder(place: Path, new: Path, token: str) -> None:
    """Replace the folder `place` by the folder `new`, which has its manifest.

    `place` is renamed to `.NAME.TOKEN.old` and `new` to `place`; then foreign files move over and
    the old folder is removed. At any moment the old or the new result is there, or, between the two
    renamings, neither: `restore_folder` puts the old one back. Where `place` cannot be renamed, the
    files are replaced one by one, the report removed first and written last.
    """
    if not os.path.lexists(place):
        os.rename(new, place)
        return
    with suppress(OSError):
        os.chmod(new, stat.S_IMODE(place.stat().st_mode))
    old = hidden_path(place, f"{token}.old")
    if lock_folder(place) == place or _holds_current_folder(place) or not _try_rename(place, old):
        _replace_file_by_file(new, place)
        return
    try:
        os.rename(new, place)
    except OSError:
        os.rename(old, place)
        raise
    _move_foreign(old, place)


def restore_folder(place: Path) -> None:
    """Tidy up after a run that was killed in `replace_folder`; the caller holds the lock.

    The old result comes back where no new one is there; else its foreign files move to the new
    one. Raises OSError where that fails.
    """
    for old in leftover_folders(place, "old"):
        if os.path.lexists(place):
            log.info("%s: an earlier run was ended here; tidying up after it", place)
            _move_foreign(old, place)
        else:
            log.info("%s: an earlier run was ended here; the result before it is back", place)
            os.rename(old, place)


def _try_rename(place: Path, old: Path) -> bool:
    try:
        os.rename(place, old)
    except OSError:  # it is in use (Windows)
        return False
    return True


def _holds_current_folder(place: Path) -> bool:
    """Whether a shell that started this process would be left in a folder that is gone."""
    with suppress(OSError):
        return Path(os.path.realpath(os.getcwd())).is_relative_to(place)
    return False


def _move_foreign(old: Path, place: Path) -> None:
    """Move foreign files from `old` to `place`, and remove the rest and `old` itself."""
    _move_foreign_in(old, place, "", _read_manifest(old))
    # Last: a run that goes on from here needs to know which files are our own.
    with suppress(FileNotFoundError):
        os.unlink(old / MANIFEST)
    os.rmdir(old)


def _move_foreign_in(old: Path, place: Path, below: str, entries: set[_Entry]) -> None:
    """`_move_foreign` for the folder `old`, which a result called `below`, with a / at its end."""
    # Files that keep their name go first: another file may be renamed to it.
    for path in sorted(old.iterdir(), key=lambda p: (os.path.lexists(place / p.name), p.name)):
        name, there = f"{below}{path.name}", place / path.name
        if name == MANIFEST and _is_file(path):
            continue
        if _is_folder(path) and (_is_folder(there) or _has_entries_below(name, entries)):
            kept = there if _is_folder(there) else _unused_name(there)
            _move_foreign_in(path, kept, f"{name}/", entries)
            os.rmdir(path)
        elif _is_own(path, name, entries):
            os.unlink(path)
        else:
            place.mkdir(parents=True, exist_ok=True)
            os.rename(path, _unused_name(there))


def _has_entries_below(name: str, entries: set[_Entry]) -> bool:
    return any(entry.name.startswith(f"{name}/") for entry in entries)


def _replace_file_by_file(new: Path, place: Path) -> None:
    """Replace the files in `place` by those of `new`, one by one."""
    earlier, entries = _read_manifest(place), _read_manifest(new)
    # If this is interrupted, the next run knows all of these files as our own.
    _set_aside_foreign(place, Path(MANIFEST), earlier)
    _write_manifest(place, earlier | entries)
    names = {entry.name for entry in entries}
    gone = sorted({entry.name for entry in earlier} - names)
    for name in [REPORT, *gone]:
        _remove_own(place, name, earlier)
    if REPORT in names:
        _set_aside_foreign(place, Path(REPORT), earlier)
    for folder in sorted(path for path in new.rglob("*") if path.is_dir()):
        _make_folder(place, folder.relative_to(new))
    for name in sorted(names, key=lambda name: (name == REPORT, name)):
        _set_aside_foreign(place, Path(name), earlier | entries)
        os.replace(new / name, place / name)
    os.replace(new / MANIFEST, place / MANIFEST)


def _remove_own(place: Path, name: str, entries: set[_Entry]) -> None:
    folders = [place / parent for parent in Path(name).parents][:-1]
    if all(_is_folder(folder) for folder in folders):
        if _is_own(place / name, name, entries):
            os.unlink(place / name)
        with suppress(OSError):  # they hold something else
            for folder in folders:
                os.rmdir(folder)


def _set_aside_foreign(place: Path, name: Path, entries: set[_Entry]) -> None:
    """Rename a foreign file that has the `name` of a new one, and make the new one's folders."""
    _make_folder(place, name.parent)
    path, said = place / name, name.as_posix()
    ours = _is_file(path) if said == MANIFEST else _is_own(path, said, entries)
    if os.path.lexists(path) and not ours:
        os.rename(path, _unused_name(path))


def _make_folder(place: Path, name: Path) -> None:
    """Make the folder `name` in `place`; links and files where it should be are set aside."""
    for folder in [place / part for part in (name, *name.parents)][-2::-1]:
        if not _is_folder(folder):
            if os.path.lexists(folder):
                os.rename(folder, _unused_name(folder))
            os.mkdir(folder)


def _unused_name(path: Path) -> Path:
    """`path`, or the first of NAME.kept, NAME.kept-2 and so on that is not taken."""
    if not os.path.lexists(path):
        return path
    number, free = 1, path.with_name(f"{path.name}.kept")
    while os.path.lexists(free):
        number += 1
        free = path.with_name(f"{path.name}.kept-{number}")
    log.warning("%s was not written by nrdf, or changed since: it is kept as %s", path, free.name)
    return free


def _is_folder(path: Path) -> bool:
    """Whether it is a folder itself, not a link to one."""
    with suppress(OSError):
        return stat.S_ISDIR(path.lstat().st_mode)
    return False


def _is_file(path: Path) -> bool:
    """Whether it is a regular file itself, not a link to one."""
    with suppress(OSError):
        return stat.S_ISREG(path.lstat().st_mode)
    return False


def _is_own(path: Path, name: str, entries: set[_Entry]) -> bool:
    """Whether a path is a regular file, as it was when a result was written."""
    with suppress(OSError):
        size = path.lstat().st_size
        alike = _is_file(path) and any(e.name == name and e.bytes == size for e in entries)
        return alike and _file_entry(path, name) in entries
    return False


def _file_entry(path: Path, name: str) -> _Entry:
    with open(path, "rb") as file:
        digest = sha256_of(file)
    return _Entry(name, path.stat().st_size, digest)


def _read_manifest(folder: Path) -> set[_Entry]:
    """The files that a result's manifest lists; none where there is no manifest, or no good one."""
    path = folder / MANIFEST
    try:
        if not _is_file(path):
            return set()
        rows = json.loads(read_file(path, OutputError, _LARGEST_MANIFEST))["files"]
        entries = {_Entry(str(r["name"]), int(r["bytes"]), str(r["sha256"])) for r in rows}
    except (OutputError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return set()
    inside = {e for e in entries if not Path(e.name).anchor and ".." not in Path(e.name).parts}
    return {e for e in inside if Path(e.name).as_posix() == e.name != "."}


def _write_manifest(folder: Path, entries: set[_Entry]) -> None:
    content = {"files": [entry._asdict() for entry in sorted(entries)]}
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    write_atomically(folder / MANIFEST, [text.encode("utf-8", "surrogateescape")])
