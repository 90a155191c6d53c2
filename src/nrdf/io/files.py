"""Opening files that users name: regular files only, and only up to a size.

A name may be that of a pipe, which a reader waits for without end, or of a device, which has no
end. Every reader of users' files opens them here, or calls `require_file` first.
"""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path
from typing import BinaryIO

from nrdf.errors import NrdfError

_PART = 1 << 20  # bytes that are read at once
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe (FIFO)",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def require_file(path: str | Path, error: type[NrdfError]) -> int:
    """Bytes that the regular file `path` (or what it links to) has.

    Raises `error`, at once, where there is none, or it is a folder, pipe, socket or device.
    """
    try:
        return _size(path, os.stat(path), error)
    except (OSError, ValueError) as problem:  # ValueError: a NUL in the name
        raise _unreadable(path, problem, error) from None


def open_file(path: str | Path, error: type[NrdfError]) -> BinaryIO:
    """The regular file `path`, opened to read bytes. Raises `error` as `require_file` does, and
    where it may not be read."""
    require_file(path, error)  # before opening: opening alone makes some devices act
    try:
        file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115 (the caller closes it)
    except OSError as problem:
        raise _unreadable(path, problem, error) from None
    try:
        _size(path, os.fstat(file.fileno()), error)
    except NrdfError:
        file.close()
        raise
    return file


def sha256_of(file: BinaryIO) -> str:
    """SHA-256 of what is left of an open file, in hexadecimal digits."""
    digest = hashlib.sha256()
    while part := file.read(_PART):
        digest.update(part)
    return digest.hexdigest()


def read_file(path: str | Path, error: type[NrdfError], most: int) -> bytes:
    """The content of the regular file `path`, of at most `most` bytes.

    Raises `error` as `open_file` does, for a larger file, and where reading fails.
    """
    with open_file(path, error) as file:
        try:
            content = file.read(most + 1)
        except OSError as problem:
            raise _unreadable(path, problem, error) from None
    if len(content) > most:
        raise error(f"{path} has more than {most / 1e6:g} MB, too much for what it should be")
    return content


def _without_waiting(path: str, flags: int) -> int:
    """Opens without waiting: another process may have put a pipe in the file's place by now."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _size(path: str | Path, found: os.stat_result, error: type[NrdfError]) -> int:
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "something else")
        raise error(f"cannot read {path}: it is {kind}; a file is needed")
    return found.st_size


def _unreadable(path: str | Path, problem: Exception, error: type[NrdfError]) -> NrdfError:
    name = str(path).replace("\0", "\\0")
    return error(f"cannot read {name}: {getattr(problem, 'strerror', None) or problem}")
