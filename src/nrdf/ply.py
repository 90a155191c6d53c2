"""Reading and writing the Stanford PLY format: ASCII and binary of both byte orders.

The header of a file is a stranger's claim: counts are checked against the file's size before any
memory is set aside for them.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from nrdf.errors import CloudError, OutputError

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_LONGEST_HEADER = 1 << 16
MOST_POINTS = 200_000_000


@dataclass
class Property:
    """One property: its NumPy type, and that of its length if it is a list."""

    name: str
    kind: str
    length_kind: str | None = None


@dataclass
class Element:
    """One element of a header: its name, its count and its properties, in the file's order."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def smallest_row(self) -> int:
        """Fewest bytes that a row takes in a binary file: a list takes at least its length."""
        return sum(np.dtype(p.length_kind or p.kind).itemsize for p in self.properties)


@dataclass
class Header:
    """What a PLY header says; `byte_order` is "" for ASCII; `start` is where the data begin."""

    byte_order: str
    elements: list[Element]
    comments: list[str]
    start: int

    def count(self, name: str) -> int:
        """Rows of the element `name`, 0 if there is none."""
        return sum(e.count for e in self.elements if e.name == name)


def read_header(path: Path) -> Header:
    """Header of the PLY file `path`.

    Raises CloudError if it is not PLY, malformed, or claims more rows than the file can hold.
    """
    with open(path, "rb") as file:
        header = _parse_header(path, file)
        left = os.fstat(file.fileno()).st_size - header.start
    for element in header.elements:
        if element.count > MOST_POINTS:
            raise CloudError(
                f"{path}: the header claims {element.count} rows of '{element.name}'; "
                f"at most {MOST_POINTS} are read"
            )
        # An ASCII row takes at least one digit and one separator for each value.
        row = element.smallest_row if header.byte_order else 2 * len(element.properties)
        left -= element.count * row
        if left < -1:  # the last ASCII line may lack its line end
            raise CloudError(
                f"{path}: truncated: the header claims {element.count} rows of '{element.name}', "
                "more than the file holds; copy or export it again"
            )
    return header


def _parse_header(path: Path, file: BinaryIO) -> Header:
    def bad(what: str) -> CloudError:
        return CloudError(f"{path}: damaged PLY header: {what}")

    if file.readline(16).strip() != b"ply":
        raise CloudError(f"{path}: not a PLY file: the first line is not 'ply'")
    byte_order: str | None = None
    elements: list[Element] = []
    comments: list[str] = []
    while True:
        raw = file.readline(_LONGEST_HEADER)
        if not raw.endswith(b"\n") or file.tell() > _LONGEST_HEADER:
            raise bad(f"no 'end_header' within {_LONGEST_HEADER} bytes")
        line = raw.decode("ascii", errors="replace").strip()
        words = line.split()
        if not words:
            continue
        if words[0] == "end_header":
            break
        if words[0] in ("comment", "obj_info"):
            comments.append(line.partition(" ")[2].strip())
        elif words[0] == "format" and len(words) == 3:
            byte_order = _FORMATS.get(words[1])
            if byte_order is None:
                raise bad(f"format '{words[1]}'; known: {', '.join(_FORMATS)}")
        elif words[0] == "element" and len(words) == 3 and words[2].isdigit():
            elements.append(Element(words[1], int(words[2])))
        elif words[0] == "property" and elements and len(words) in (3, 5):
            kinds = words[2:4] if words[1] == "list" else words[1:2]
            if len(words) != len(kinds) + (3 if words[1] == "list" else 2) or any(
                kind not in _TYPES for kind in kinds
            ):
                raise bad(f"cannot understand '{line[:80]}'")
            length = _TYPES[kinds[0]] if len(kinds) == 2 else None
            if length is not None and length[0] == "f":
                raise bad(f"the length of a list must be an integer: '{line[:80]}'")
            elements[-1].properties.append(Property(words[-1], _TYPES[kinds[-1]], length))
        else:
            raise bad(f"cannot understand '{line[:80]}'")
    if byte_order is None:
        raise bad("no 'format' line")
    for element in elements:
        names = [p.name for p in element.properties]
        if len(set(names)) != len(names):
            raise bad(f"a property of '{element.name}' is named twice")
        if not names and element.count:
            raise bad(f"element '{element.name}' has no property")
    return Header(byte_order, elements, comments, file.tell())


def read_scalars(path: Path, header: Header, name: str = "vertex") -> dict[str, np.ndarray]:
    """Every scalar property (n,) of the element `name`, by name; lists are skipped.

    Raises CloudError if the element is missing, or if its rows are damaged or truncated.
    """
    before: list[Element] = []
    for element in header.elements:
        if element.name == name:
            break
        before.append(element)
    else:
        raise CloudError(f"{path}: no element '{name}' in this PLY file, so no points")
    with open(path, "rb") as file:
        file.seek(header.start)
        try:
            if header.byte_order:
                for other in before:
                    _read_binary(file, other, header.byte_order)
                return _read_binary(file, element, header.byte_order)
            for other in before:
                _read_ascii(file, other)
            return _read_ascii(file, element)
        except (ValueError, EOFError, MemoryError) as error:
            raise CloudError(
                f"{path}: truncated or damaged: cannot read {element.count} rows of '{name}' "
                f"({error}); copy or export it again"
            ) from error


def _read_binary(file: BinaryIO, element: Element, order: str) -> dict[str, np.ndarray]:
    if all(p.length_kind is None for p in element.properties):
        row = np.dtype([(p.name, order + p.kind) for p in element.properties])
        table = np.fromfile(file, dtype=row, count=element.count)
        if len(table) < element.count:
            raise EOFError(f"only {len(table)} complete rows")
        return {p.name: table[p.name] for p in element.properties}
    scalars = [p for p in element.properties if p.length_kind is None]
    values = {p.name: np.empty(element.count, order + p.kind) for p in scalars}
    for i in range(element.count):
        for p in element.properties:
            value = _take(file, order + (p.length_kind or p.kind))
            if p.length_kind is None:
                values[p.name][i] = value
                continue
            length = int(value)
            if length < 0:
                raise ValueError(f"a list of length {length}")
            file.seek(length * np.dtype(p.kind).itemsize, os.SEEK_CUR)
    if file.tell() > os.fstat(file.fileno()).st_size:
        raise EOFError("the last list runs past the end of the file")
    return values


def _take(file: BinaryIO, kind: str) -> float:
    raw = file.read(np.dtype(kind).itemsize)
    if len(raw) < np.dtype(kind).itemsize:
        raise EOFError("the file ends within a row")
    return float(np.frombuffer(raw, kind)[0])


def _read_ascii(file: BinaryIO, element: Element) -> dict[str, np.ndarray]:
    properties = element.properties
    if element.count == 0:
        return {p.name: np.empty(0) for p in properties if p.length_kind is None}
    if all(p.length_kind is None for p in properties):
        table = np.loadtxt(file, max_rows=element.count, ndmin=2, comments=None)
        if table.shape != (element.count, len(properties)):
            raise ValueError(
                f"found {table.shape[0]} rows of {table.shape[1]} values, "
                f"expected {element.count} of {len(properties)}"
            )
        return {p.name: table[:, i] for i, p in enumerate(properties)}
    values = {p.name: np.empty(element.count) for p in properties if p.length_kind is None}
    for i in range(element.count):
        words = file.readline().split()
        position = 0
        for p in properties:
            if position >= len(words):
                raise EOFError(f"row {i} has {len(words)} values, too few")
            if p.length_kind is None:
                values[p.name][i] = float(words[position])
            else:
                length = int(words[position])
                if length < 0 or position + length >= len(words):
                    raise ValueError(f"row {i} has a list of length {length}")
                position += length
            position += 1
    return values


def write_rows(path: Path, columns: Mapping[str, np.ndarray], comments: list[str]) -> None:
    """Write `columns`, each (n,), as the vertices of a binary little-endian PLY file, atomically.

    Floating-point columns keep their width, integers become uchar if they are uint8, else int.
    Raises OutputError if the file cannot be written; nothing half-written stays behind.
    """
    names = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int"}
    rows = len(next(iter(columns.values())))
    layout = []
    for name, column in columns.items():
        kind = column.dtype.str[1:]
        layout.append((name, "<" + (kind if kind in names else "f4")))
    table = np.empty(rows, dtype=layout)
    for name, column in columns.items():
        table[name] = column
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {' '.join(c.split())}" for c in comments),
    ]
    lines.append(f"element vertex {rows}")
    lines += [f"property {names[kind[1:]]} {name}" for name, kind in layout]
    header = ("\n".join([*lines, "end_header"]) + "\n").encode("ascii", errors="replace")
    write_atomically(path, [header, table.data if rows else b""])


def write_atomically(path: Path, parts: list[bytes | memoryview]) -> None:
    """Write `parts` one after another to `path` so that it holds all of them or stays as it was.

    Raises OutputError if the folder is missing, not writable or full.
    """
    # Named before it exists: whatever ends this process has it cleared away.
    temporary = path.parent / f".{path.name}.{secrets.token_hex(4)}.part"
    try:
        with open(temporary, "xb") as file:
            for part in parts:
                file.write(part)
        os.replace(temporary, path)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()
