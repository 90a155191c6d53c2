"""One run at a time writes to a place, and clears what a killed run left there.

Beside a file or folder NAME lies `.NAME.lock` as long as a run writes it. The operating system
takes the lock from a process that ends in whatever way, so a run that is alive can be told from a
dead one, whatever their process numbers. Beside it lie as well, until they are whole,
`.NAME.TOKEN.part` (a file), `.NAME.TOKEN.tmp` and, for a moment, `.NAME.TOKEN.old` (folders).
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
    """No other run writes to `path`, a file or folder or neither yet, until the block ends.

    Makes the parents that are missing (those that are still empty at the end go again), and
    removes what killed runs left of `path`. Where another run is writing there, raises OutputError
    at once; with `wait`, waits for it. Raises OutputError too where the place cannot be written.
    """
    from filelock import FileLock, Timeout

    place = resolve_links(path)
    file, made = hidden_path(place, "lock"), _missing(lock_folder(place))
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
            _clear(place)
        yield
    finally:
        if lock.is_locked:
            # Before it is given back: who opened it meanwhile sees that its name is gone, and
            # begins anew. Windows removes no open file; there, releasing removes it.
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
    """The folder in which the lock of `place`, and what is not whole, lie.

    Its parent; itself for a folder that cannot be moved: a mount point, as containers have, or one
    in a folder that is not ours to write.
    """
    parent = place.parent
    if place.is_dir() and (os.path.ismount(place) or not os.access(parent, os.W_OK | os.X_OK)):
        return place
    return parent


def hidden_path(place: Path, ending: str) -> Path:
    """The name beside `place`, or in it, that ends in `ending`."""
    return lock_folder(place) / f".{place.name}.{ending}"


def random_token() -> str:
    """What tells names of runs apart, alike in process number and time though they be."""
    return secrets.token_hex(4)


def leftover_folders(place: Path, ending: str) -> list[Path]:
    """Folders `.NAME.TOKEN.ending` of `place`."""
    name = re.compile(rf"\.{re.escape(place.name)}\.{_TOKEN}\.{ending}")
    return [path for path in _named(lock_folder(place), name) if stat.S_ISDIR(path.lstat().st_mode)]


def _clear(place: Path) -> None:
    """Remove what killed runs left of `place`, and files in it that are not whole. What was set
    aside (`.old`) holds other people's files, and stays."""
    for folder in leftover_folders(place, "tmp"):
        shutil.rmtree(folder, ignore_errors=True)
    remove_partial_files(lock_folder(place), place.name)
    if place.is_dir():
        remove_partial_files(place)


def remove_partial_files(folder: Path, name: str | None = None) -> None:
    """Remove the files in `folder`, those of one `name` or all, that killed runs left half-written.

    Those of a name that is locked may be another run's, and stay.
    """
    for path in _named(folder, _PART):
        found = _PART.fullmatch(path.name)
        of = found[1] if found else ""
        mine = of == name if name is not None else not (folder / f".{of}.lock").exists()
        if mine and stat.S_ISREG(path.lstat().st_mode):
            path.unlink()


def _named(folder: Path, name: re.Pattern[str]) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if name.fullmatch(path.name))


def _missing(folder: Path) -> list[Path]:
    """What there is not of a folder and its parents, outermost first."""
    return [p for p in (folder, *folder.parents) if not p.exists()][::-1]


def _remove_empty(folders: list[Path]) -> None:
    with suppress(OSError):  # somebody has put something there, or took it away
        for folder in reversed(folders):
            folder.rmdir()
