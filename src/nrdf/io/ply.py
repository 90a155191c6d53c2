"""Reading and writing the Stanford PLY format: ASCII and binary of both byte orders.

A header may be wrong: counts are checked against the file's size before memory is taken for them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from nrdf.errors import CloudError
from nrdf.io.atomic import write_atomically
from nrdf.io.files import open_file
from nrdf.io.rows import MAX_POINTS, binary_parts, count_rows, gather, text_parts

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_COUNT = re.compile("[0-9]{1,100}")
_LONGEST_HEADER = 1 << 16


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

    Raises CloudError if it is not PLY, malformed, or claims more rows than the file can hold, or
    fewer than it holds.
    """
    with open_file(path, CloudError) as file:
        header = _parse_header(path, file)
        left = os.fstat(file.fileno()).st_size - header.start
        claimed = sum(element.count for element in header.elements)
        if not header.byte_order and count_rows(file, claimed) > claimed:
            raise _too_many(path, f"{claimed} rows")
    for element in header.elements:
        if element.count > MAX_POINTS:
            raise CloudError(
                f"{path}: the header claims {element.count} rows of '{element.name}'; "
                f"at most {MAX_POINTS} are read"
            )
        # An ASCII row takes at least one digit and one separator for each value.
        row = element.smallest_row if header.byte_order else 2 * len(element.properties)
        left -= element.count * row
        if left < -1:  # the last ASCII line may lack its line end
            raise CloudError(
                f"{path}: truncated: the header claims {element.count} rows of '{element.name}', "
                "more than the file holds; copy or export it again"
            )
    filled = [element for element in header.elements if element.count]
    lists = any(p.length_kind for element in filled for p in element.properties)
    if header.byte_order and filled and not lists and left >= filled[-1].smallest_row:
        raise _too_many(path, f"{filled[-1].count} rows of '{filled[-1].name}'")
    return header


def _too_many(path: Path, what: str) -> CloudError:
    return CloudError(
        f"{path}: the header claims {what}, but the file holds more: which of the two is right "
        "cannot be told; correct the header or export the file again"
    )


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
        elif words[0] == "element" and len(words) == 3 and _COUNT.fullmatch(words[2]):
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


def read_scalars(
    path: Path, header: Header, name: str = "vertex", wanted: Container[str] | None = None
) -> dict[str, np.ndarray]:
    """Every scalar property (n,) of the element `name`, or those `wanted`, by name; lists are
    skipped.

    Raises CloudError if the element is missing, or if its rows are damaged or truncated.
    """
    before: list[Element] = []
    for element in header.elements:
        if element.name == name:
            break
        before.append(element)
    else:
        raise CloudError(f"{path}: no element '{name}' in this PLY file, so no points")
    with open_file(path, CloudError) as file:
        file.seek(header.start)
        try:
            for other in before:
                _read_rows(file, other, header.byte_order, ())
            return _read_rows(file, element, header.byte_order, wanted)
        except (ValueError, EOFError, MemoryError) as error:
            raise CloudError(
                f"{path}: truncated or damaged: cannot read {element.count} rows of '{name}' "
                f"({error}); copy or export it again"
            ) from error


def _read_rows(
    file: BinaryIO, element: Element, order: str, wanted: Container[str] | None
) -> dict[str, np.ndarray]:
    """The `wanted` scalar properties (n,) of the element whose rows come next in the file."""
    names = [p.name for p in element.properties]
    lists = any(p.length_kind for p in element.properties)
    kept = [
        p for p in element.properties
        if p.length_kind is None and (wanted is None or p.name in wanted)
    ]  # fmt: skip
    if order and not lists:
        row = np.dtype([(p.name, order + p.kind) for p in element.properties])
        return gather(binary_parts(file, row, element.count), element.count, [p.name for p in kept])
    if not lists:
        values: dict[str, np.ndarray] = {p.name: np.empty(element.count) for p in kept}
        for start, part in text_parts(file, element.count, len(names)):
            for p in kept:
                values[p.name][start : start + len(part)] = part[:, names.index(p.name)]
        return values
    values = {p.name: np.empty(element.count, order + p.kind if order else "f8") for p in kept}
    read_row = _read_binary_row if order else _read_text_row
    for i in range(element.count):
        for name, value in read_row(file, element, order).items():
            if name in values:
                values[name][i] = value
    if file.tell() > os.fstat(file.fileno()).st_size:
        raise EOFError("the last list runs past the end of the file")
    return values


def _read_binary_row(file: BinaryIO, element: Element, order: str) -> dict[str, float]:
    values = {}
    for p in element.properties:
        value = _read_value(file, order + (p.length_kind or p.kind))
        if p.length_kind is None:
            values[p.name] = value
            continue
        length = int(value)
        if length < 0:
            raise ValueError(f"a list of length {length}")
        file.seek(length * np.dtype(p.kind).itemsize, os.SEEK_CUR)
    return values


def _read_text_row(file: BinaryIO, element: Element, _: str) -> dict[str, float]:
    words = file.readline().split()
    values, position = {}, 0
    for p in element.properties:
        if position >= len(words):
            raise EOFError(f"a row has {len(words)} values, too few")
        if p.length_kind is None:
            values[p.name] = float(words[position])
        else:
            length = int(words[position])
            if length < 0 or position + length >= len(words):
                raise ValueError(f"a row has a list of length {length}")
            position += length
        position += 1
    return values


def _read_value(file: BinaryIO, kind: str) -> float:
    raw = file.read(np.dtype(kind).itemsize)
    if len(raw) < np.dtype(kind).itemsize:
        raise EOFError("the file ends within a row")
    return float(np.frombuffer(raw, kind)[0])


def write_ply(path: Path, columns: Mapping[str, np.ndarray], comments: list[str]) -> None:
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
    lines = [f"element vertex {rows}"]
    lines += [f"property {names[kind[1:]]} {name}" for name, kind in layout]
    write_atomically(path, [_binary_header(lines, comments), table.data if rows else b""])


def write_ply_mesh(
    path: Path, vertices: np.ndarray, faces: np.ndarray, comments: list[str]
) -> None:
    """Write triangles, vertices (v, 3) and faces (f, 3), as `write_ply` does; coordinates keep all
    their digits."""
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corners", "<i4", (3,))])
    rows["count"], rows["corners"] = 3, faces
    lines = [
        f"element vertex {len(vertices)}",
        *(f"property double {name}" for name in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
    ]
    places = np.ascontiguousarray(vertices, dtype="<f8")
    parts = [part.tobytes() for part in (places, rows) if len(part)]
    write_atomically(path, [_binary_header(lines, comments), *parts])


def _binary_header(lines: list[str], comments: list[str]) -> bytes:
    said = [f"comment {' '.join(c.split())}" for c in comments]
    every = ["ply", "format binary_little_endian 1.0", *said, *lines, "end_header"]
    return ("\n".join(every) + "\n").encode("ascii", errors="replace")
