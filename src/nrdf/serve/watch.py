"""A watched folder: a file counts when it has stopped growing."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from nrdf.errors import DataError

_UNFINISHED = (".part", ".tmp", ".crdownload", ".filepart", "~")
"""Endings of what is still being copied."""
_MOST_DEEP = 3


@dataclass(frozen=True)
class ArrivedFile:
    """A file that has stopped growing. label: its name as seen from the inbox."""

    path: Path
    label: str
    bytes: int
    mtime_ns: int


@dataclass
class Watcher:
    """Looks into a folder, and folders in it, by polling: network drives send no events."""

    inbox: Path
    settle_s: float
    _seen: dict[str, tuple[int, int, float]] = field(default_factory=dict)
    _given: dict[str, tuple[int, int]] = field(default_factory=dict)

    def arrived(self, now: float | None = None) -> list[ArrivedFile]:
        """Files that have not changed for `settle_s`, each once, until it changes again.

        Hidden files, those whose name says that they are being copied, and empty ones do not count.
        Raises DataError where the inbox cannot be read.
        """
        now = time.monotonic() if now is None else now
        found, there = [], set()
        for path, size, mtime_ns in self._files():
            there.add(path)
            if self._given.get(path) == (size, mtime_ns):
                continue
            known = self._seen.get(path)
            if known is None or known[:2] != (size, mtime_ns):
                self._seen[path] = (size, mtime_ns, now)
            elif now - known[2] >= self.settle_s:
                self._given[path] = (size, mtime_ns)
                del self._seen[path]
                label = Path(path).relative_to(self.inbox).as_posix()
                found.append(ArrivedFile(Path(path), label, size, mtime_ns))
        # What has gone takes no memory, so weeks make no difference.
        for kept in (self._seen, self._given):
            for path in [path for path in kept if path not in there]:
                del kept[path]  # type: ignore[attr-defined]
        return sorted(found, key=lambda file: (file.mtime_ns, file.label))

    def settling(self) -> int:
        """How many files are there that may still grow."""
        return len(self._seen)

    def _files(self) -> Iterator[tuple[str, int, int]]:
        folders = [(str(self.inbox), 0)]
        while folders:
            folder, depth = folders.pop()
            try:
                entries = list(os.scandir(folder))
            except OSError as error:
                if depth == 0:
                    raise DataError(f"cannot read the inbox {folder}: {error.strerror}") from None
                continue
            for entry in entries:
                if entry.name.startswith(".") or entry.name.endswith(_UNFINISHED):
                    continue
                try:
                    if entry.is_dir(follow_symlinks=False):
                        if depth < _MOST_DEEP:
                            folders.append((entry.path, depth + 1))
                    elif entry.is_file():
                        known = entry.stat()
                        if known.st_size:
                            yield entry.path, known.st_size, known.st_mtime_ns
                except OSError:
                    continue  # it has gone meanwhile
