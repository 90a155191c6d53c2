"""Rows of numbers in text and binary files, some at a time, so that large files fit in memory."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import BinaryIO

import numpy as np

MAX_POINTS = 200_000_000
_PART = 1 << 25  # bytes of binary rows, or values of text, that are held at a time


def text_rows(file: BinaryIO) -> Iterator[bytes]:
    """The lines of a text file that follow and are neither blank nor a comment."""
    for line in file:
        if not line.isspace() and not line.lstrip().startswith(b"#"):
            yield line


def count_rows(file: BinaryIO, most: int) -> int:
    """How many `text_rows` follow; counts no further than one beyond `most`."""
    return sum(1 for _ in islice(text_rows(file), most + 1))


def binary_parts(file: BinaryIO, row: np.dtype, count: int) -> Iterator[np.ndarray]:
    """The next `count` packed rows of a file, some at a time.

    Raises EOFError where the file ends before.
    """
    step = max(1, _PART // row.itemsize)
    for start in range(0, count, step):
        part = np.fromfile(file, dtype=row, count=min(step, count - start))
        if len(part) < min(step, count - start):
            raise EOFError(f"truncated: only {start + len(part)} complete rows of {count}")
        yield part


def gather(parts: Iterator[np.ndarray], count: int, names: list[str]) -> dict[str, np.ndarray]:
    """The fields `names`, each (count,), of rows that come some at a time."""
    columns: dict[str, np.ndarray] = {}
    start = 0
    for part in parts:
        for name in names:
            if name not in columns:
                columns[name] = np.empty(count, part.dtype[name])
            columns[name][start : start + len(part)] = part[name]
        start += len(part)
    return columns or {name: np.empty(0) for name in names}


def text_parts(file: BinaryIO, count: int, width: int) -> Iterator[tuple[int, np.ndarray]]:
    """The next `count` rows of `width` numbers in a text file, some at a time: the number of the
    first row, and the rows (m, width) float64.

    Raises ValueError for rows that are too few, too long or too short, or no numbers.
    """
    place = file.tell()
    if count_rows(file, count) < count:
        raise ValueError(f"the file ends before row {count}")
    file.seek(place)
    step = max(1, _PART // (8 * width))
    for start in range(0, count, step):
        rows = min(step, count - start)
        part = np.loadtxt(islice(text_rows(file), rows), ndmin=2, comments=None)
        if part.shape != (rows, width):
            raise ValueError(
                f"found {start + part.shape[0]} rows of {part.shape[1]} values, "
                f"expected {count} of {width}"
            )
        yield start, part
