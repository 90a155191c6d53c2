"""Putting a new result in the place of an earlier one, and keeping what nrdf did not write there.

A result's folder holds MANIFEST, the list of its files with sizes and checksums. Only a regular
file that is still exactly what an earlier result's list says is removed. Everything else stays, or
is called NAME.kept where the new result has something of that name. Links are not followed.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from nrdf.errors import OutputError
from nrdf.io.atomic import write_atomically
from nrdf.io.files import read_file
from nrdf.io.locks import hidden_path, leftover_folders, lock_folder

log = logging.getLogger(__name__)

MANIFEST = ".nrdf-files.json"
REPORT = "report.json"
_LARGEST_MANIFEST = 1 << 26
_CHUNK = 1 << 20


class _Entry(NamedTuple):
    """A file of a result: its name in the folder, with / between parts."""

    name: str
    bytes: int
    sha256: str


def write_manifest(folder: Path) -> None:
    """Write the list of all files in `folder`. Raises OutputError."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    _write(folder, {_entry(path, path.relative_to(folder).as_posix()) for path in files})


def replace_folder(place: Path, new: Path, token: str) -> None:
    """Make the whole folder `new`, with its manifest, the folder `place`.

    Beside each other: `place` becomes `.NAME.TOKEN.old`, `new` becomes `place`, and what nrdf did
    not write moves over from the old one, of which nothing is left. At any moment there is the old
    or the new result, or, between two calls, neither: `restore_folder` puts the old one back. A
    folder that cannot be moved gets the files one by one, its report removed first and written
    last.
    """
    if not os.path.lexists(place):
        os.rename(new, place)
        return
    with suppress(OSError):
        os.chmod(new, stat.S_IMODE(place.stat().st_mode))
    old = hidden_path(place, f"{token}.old")
    if lock_folder(place) == place or _holds_working_folder(place) or not _renamed(place, old):
        _move_in(new, place)
        return
    try:
        os.rename(new, place)
    except OSError:
        os.rename(old, place)
        raise
    _keep(old, place)


def restore_folder(place: Path) -> None:
    """Finish what a run that was killed in `replace_folder` had begun; the caller holds the claim.

    What it set aside comes back where there is nothing in its place; else other people's files in
    it do. Raises OSError where that fails.
    """
    for old in leftover_folders(place, "old"):
        if os.path.lexists(place):
            log.info("%s: an earlier run was ended here; tidying up after it", place)
            _keep(old, place)
        else:
            log.info("%s: an earlier run was ended here; the result before it is back", place)
            os.rename(old, place)


def _renamed(place: Path, old: Path) -> bool:
    try:
        os.rename(place, old)
    except OSError:  # it is in use (Windows)
        return False
    return True


def _holds_working_folder(place: Path) -> bool:
    """Whether a shell that started this process would be left in a folder that is gone."""
    with suppress(OSError):
        return Path(os.path.realpath(os.getcwd())).is_relative_to(place)
    return False


def _keep(old: Path, place: Path) -> None:
    """Move from `old` to `place` what is not ours, remove the rest and `old` itself."""
    _keep_in(old, place, "", _read(old))
    # At the very end: a run that goes on with this needs to know what is ours.
    with suppress(FileNotFoundError):
        os.unlink(old / MANIFEST)
    os.rmdir(old)


def _keep_in(old: Path, place: Path, below: str, entries: set[_Entry]) -> None:
    """`_keep` for the folder `old`, which was called `below` (with a / at its end) in a result."""
    # What keeps its name goes first: it may be what something else would be called.
    for path in sorted(old.iterdir(), key=lambda p: (os.path.lexists(place / p.name), p.name)):
        name, there = f"{below}{path.name}", place / path.name
        if name == MANIFEST and _is_file(path):
            continue
        if _is_folder(path) and (_is_folder(there) or _names_below(name, entries)):
            kept = there if _is_folder(there) else _free(there)
            _keep_in(path, kept, f"{name}/", entries)
            os.rmdir(path)
        elif _is_ours(path, name, entries):
            os.unlink(path)
        else:
            place.mkdir(parents=True, exist_ok=True)
            os.rename(path, _free(there))


def _names_below(name: str, entries: set[_Entry]) -> bool:
    return any(entry.name.startswith(f"{name}/") for entry in entries)


def _move_in(new: Path, place: Path) -> None:
    """Move the files of `new` into `place` one by one."""
    earlier, entries = _read(place), _read(new)
    # Whatever ends this, the next run knows all of it as ours.
    _make_room(place, Path(MANIFEST), earlier)
    _write(place, earlier | entries)
    names = {entry.name for entry in entries}
    gone = sorted({entry.name for entry in earlier} - names)
    for name in [REPORT, *gone]:
        _remove_ours(place, name, earlier)
    if REPORT in names:
        _make_room(place, Path(REPORT), earlier)
    for folder in sorted(path for path in new.rglob("*") if path.is_dir()):
        _make_folder(place, folder.relative_to(new))
    for name in sorted(names, key=lambda name: (name == REPORT, name)):
        _make_room(place, Path(name), earlier | entries)
        os.replace(new / name, place / name)
    os.replace(new / MANIFEST, place / MANIFEST)


def _remove_ours(place: Path, name: str, entries: set[_Entry]) -> None:
    folders = [place / parent for parent in Path(name).parents][:-1]
    if all(_is_folder(folder) for folder in folders):
        if _is_ours(place / name, name, entries):
            os.unlink(place / name)
        with suppress(OSError):  # they hold something else
            for folder in folders:
                os.rmdir(folder)


def _make_room(place: Path, name: Path, entries: set[_Entry]) -> None:
    """Set aside what is not ours in the place of the file `name`, and make its folders."""
    _make_folder(place, name.parent)
    path, said = place / name, name.as_posix()
    ours = _is_file(path) if said == MANIFEST else _is_ours(path, said, entries)
    if os.path.lexists(path) and not ours:
        os.rename(path, _free(path))


def _make_folder(place: Path, name: Path) -> None:
    """Make the folder `name` in `place`; links and files where it should be are set aside."""
    for folder in [place / part for part in (name, *name.parents)][-2::-1]:
        if not _is_folder(folder):
            if os.path.lexists(folder):
                os.rename(folder, _free(folder))
            os.mkdir(folder)


def _free(path: Path) -> Path:
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


def _is_ours(path: Path, name: str, entries: set[_Entry]) -> bool:
    """Whether a path is a regular file, as it was when a result was written."""
    with suppress(OSError):
        size = path.lstat().st_size
        alike = _is_file(path) and any(e.name == name and e.bytes == size for e in entries)
        return alike and _entry(path, name) in entries
    return False


def _entry(path: Path, name: str) -> _Entry:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(_CHUNK):
            digest.update(block)
    return _Entry(name, path.stat().st_size, digest.hexdigest())


def _read(folder: Path) -> set[_Entry]:
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


def _write(folder: Path, entries: set[_Entry]) -> None:
    content = {"files": [entry._asdict() for entry in sorted(entries)]}
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    write_atomically(folder / MANIFEST, [text.encode("utf-8", "surrogateescape")])
