"""One run at a time writes to a file or folder, and removes what a killed run left there.

While a run writes NAME, the file `.NAME.lock` is beside it, locked. The operating system releases
the lock when a process ends, however it ends, so a live run can be told from a dead one. Unfinished
output is beside it too: `.NAME.TOKEN.part` (a file), `.NAME.TOKEN.tmp` and, for a moment,
`.NAME.TOKEN.old` (folders).
"""

from __future__ import annotations

import errno
import logging
import os
import re
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nrdf.errors import OutputError
from nrdf.io.atomic import cannot_write, output_errors

log = logging.getLogger(__name__)

_TOKEN = "[0-9a-f]{8}"
_PART = re.compile(rf"\.(.+)\.{_TOKEN}\.part")


@contextmanager
def write_lock(path: str | Path, wait: bool = False) -> Iterator[None]:
    """Lock `path`, a file or folder that need not exist yet, against other runs' writing.

    Missing parents are made, and removed again if they are empty at the end; what killed runs left
    of `path` is removed. If another run is writing there, raises OutputError at once, or, with
    `wait`, waits for it. Also raises OutputError if `path` cannot be written.
    """
    from filelock import FileLock, Timeout

    place = resolve_links(path)
    file, made = hidden_path(place, "lock"), _missing_folders(lock_folder(place))
    lock = FileLock(file)
    try:
        with output_errors(path):
            file.parent.mkdir(parents=True, exist_ok=True)
            try:
                lock.acquire(timeout=0)
            except Timeout:
                if not wait:
                    raise OutputError(
                        f"another run is writing to {path}: wait until it has ended, or choose "
                        "another place"
                    ) from None
                log.info("waiting for another run, which is writing to %s", path)
                lock.acquire()
            _remove_leftovers(place)
        yield
    finally:
        if lock.is_locked:
            # Removed before it is released: a run that has opened it meanwhile sees that it is
            # gone, and starts again. Windows removes no open file; there, releasing does.
            with suppress(OSError):
                os.unlink(file)
            lock.release()
        _remove_empty(made)


def resolve_links(path: str | Path) -> Path:
    """`path` with all links followed. Raises OutputError for a name that no file can have."""
    try:
        place = Path(os.path.realpath(path))
        if place.is_symlink():
            raise OSError(errno.ELOOP, "the link leads back to itself")
        return place
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise cannot_write(str(path).replace("\0", "\\0"), error) from None


def lock_folder(place: Path) -> Path:
    """The folder for the lock and the unfinished output of `place`.

    Its parent; or `place` itself if it is a folder that cannot be renamed: a mount point, as
    containers have, or one whose parent cannot be written.
    """
    parent = place.parent
    if place.is_dir() and (os.path.ismount(place) or not os.access(parent, os.W_OK | os.X_OK)):
        return place
    return parent


def hidden_path(place: Path, ending: str) -> Path:
    """The path of the hidden file `.NAME.ending` that belongs to `place`."""
    return lock_folder(place) / f".{place.name}.{ending}"


def random_token() -> str:
    """Eight random hexadecimal digits, which make a run's names unique."""
    return secrets.token_hex(4)


def leftover_folders(place: Path, ending: str) -> list[Path]:
    """Hidden folders `.NAME.TOKEN.ending` of `place` that earlier runs left."""
    name = re.compile(rf"\.{re.escape(place.name)}\.{_TOKEN}\.{ending}")
    return [
        path for path in _matching(lock_folder(place), name) if stat.S_ISDIR(path.lstat().st_mode)
    ]


def _remove_leftovers(place: Path) -> None:
    """Remove unfinished output of killed runs. Folders `.old` stay: they may hold foreign files."""
    for folder in leftover_folders(place, "tmp"):
        shutil.rmtree(folder, ignore_errors=True)
    remove_partial_files(lock_folder(place), place.name)
    if place.is_dir():
        remove_partial_files(place)


def remove_partial_files(folder: Path, name: str | None = None) -> None:
    """Remove half-written files that killed runs left in `folder`, all or those of one `name`.

    Files whose name is locked stay: another run may be writing them.
    """
    for path in _matching(folder, _PART):
        found = _PART.fullmatch(path.name)
        of = found[1] if found else ""
        mine = of == name if name is not None else not (folder / f".{of}.lock").exists()
        if mine and stat.S_ISREG(path.lstat().st_mode):
            path.unlink()


def _matching(folder: Path, name: re.Pattern[str]) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if name.fullmatch(path.name))


def _missing_folders(folder: Path) -> list[Path]:
    """Those of a folder and its parents that do not exist, outermost first."""
    return [p for p in (folder, *folder.parents) if not p.exists()][::-1]


def _remove_empty(folders: list[Path]) -> None:
    with suppress(OSError):  # another process has put something there, or removed it
        for folder in reversed(folders):
            folder.rmdir()
