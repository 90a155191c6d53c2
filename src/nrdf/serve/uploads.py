"""What is sent to the service: each file whole or not there, once a key, and not for ever."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from nrdf.errors import DataError
from nrdf.io.locks import random_token
from nrdf.serve.store import safe_name

_PART = ".part-"
_YOUNG_S = 3600.0
"""Nothing younger is removed: its sender may not have been answered yet."""


@dataclass(frozen=True)
class Uploads:
    """Files in folders of their own, so that any number may have one name.

    most_bytes, most_s: beyond these, files whose objects have their outcome are removed, the oldest
    first.
    """

    folder: Path
    most_bytes: int
    most_s: float

    def place(self, name: str, key: str | None) -> Path:
        """Where a file of that name goes; the same place for the same key, a new one without."""
        suffix = "".join(c for c in Path(name).suffix if c.isalnum() or c == ".")[:12]
        inner = random_token() if key is None else hashlib.sha256(key.encode()).hexdigest()[:32]
        return self.folder / inner / f"{safe_name(name)}{suffix}"

    @contextmanager
    def receiving(self, place: Path) -> Iterator[BinaryIO]:
        """A file to write to, which is at `place` once the block has ended well; else nothing is.

        Raises DataError where nothing came, and OSError where the disk is full.
        """
        place.parent.mkdir(parents=True, exist_ok=True)
        part = place.with_name(f"{_PART}{random_token()}")
        try:
            with open(part, "xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
                if not file.tell():
                    raise DataError("the body is empty")
            if not place.exists():  # two senders with one key: the first counts
                os.rename(part, place)
        finally:
            part.unlink(missing_ok=True)
            with suppress(OSError):  # it holds a file
                place.parent.rmdir()

    def bytes(self) -> int:
        """Of all that is kept."""
        return sum(size for _, size, _ in self._files())

    def clear(self, open_sources: Collection[str], now: float | None = None) -> int:
        """Remove what is too old or too much, and is none of the open ones; how many files."""
        now = time.time() if now is None else now
        found = sorted(self._files())
        kept, removed = sum(size for _, size, _ in found), 0
        for changed, size, path in found:
            age = now - changed
            unfinished = path.name.startswith(_PART)
            if age < _YOUNG_S or str(path.absolute()) in open_sources:
                continue
            if unfinished or age > self.most_s or kept > self.most_bytes:
                with suppress(OSError):
                    path.unlink()
                    path.parent.rmdir()
                kept, removed = kept - size, removed + 1
        return removed

    def _files(self) -> Iterator[tuple[float, int, Path]]:
        """When each was last changed, its bytes, and where it is."""
        with suppress(OSError):
            for folder in os.scandir(self.folder):
                with suppress(OSError):
                    for entry in os.scandir(folder.path):
                        known = entry.stat()
                        yield known.st_mtime, known.st_size, Path(entry.path)
