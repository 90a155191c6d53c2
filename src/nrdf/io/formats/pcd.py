"""The Point Cloud Library's PCD format: DATA ascii, binary and binary_compressed (LZF)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from nrdf.errors import CloudError
from nrdf.io.files import open_file
from nrdf.io.formats.raw import (
    MAX_UNPACKED_BYTES,
    USED_COLUMNS,
    RawCloud,
    colours_of,
    intensity_of,
    stack,
)
from nrdf.io.rows import MAX_POINTS, binary_parts, count_rows, gather, text_parts

_LONGEST_HEADER = 1 << 16
_LONGEST_ROW = 1 << 16  # bytes
_LZF_BEST = 90  # most bytes out for each byte in: three bytes give 264 at best
_SIZES = {"F": ("4", "8"), "I": ("1", "2", "4", "8"), "U": ("1", "2", "4", "8")}


def read_pcd(path: Path, _: int) -> RawCloud:
    """Points, normals, colours and intensity; VIEWPOINT says where the sensor stood.

    A viewpoint at the origin counts as known only in a grid (HEIGHT above 1), where the camera's
    own frame is the usual one: the origin is also what writers put where they know nothing.
    """
    with open_file(path, CloudError) as file:
        header = _read_header(path, file)
        try:
            columns = _read_columns(file, header)
        except (KeyError, ValueError, IndexError, EOFError) as error:
            why = f"no {error} in its header" if isinstance(error, KeyError) else error
            raise CloudError(f"{path}: cannot read this PCD file: {why}") from error
    points = stack(columns, "xyz")
    if points is None:
        raise CloudError(
            f"{path}: fields x, y and z are needed; it has {', '.join(header['FIELDS'])}"
        )
    sensors: np.ndarray = np.empty((0, 3))
    try:
        pose = np.array([float(word) for word in header.get("VIEWPOINT", [])])
        grid = int(header.get("HEIGHT", ["1"])[0]) > 1
    except (ValueError, IndexError) as error:
        raise CloudError(f"{path}: damaged PCD header: {error}") from error
    if len(pose) == 7 and np.isfinite(pose).all() and (grid or pose[:3].any()):
        sensors = pose[None, :3]
    return RawCloud(
        points,
        stack(columns, ("normal_x", "normal_y", "normal_z")),
        colours=colours_of(columns),
        intensity=intensity_of(columns),
        sensors=sensors,
        gaps=True,
    )


def _read_header(path: Path, file: BinaryIO) -> dict[str, list[str]]:
    header: dict[str, list[str]] = {}
    while "DATA" not in header:
        line = file.readline(4096)
        if not line or file.tell() > _LONGEST_HEADER:
            raise CloudError(f"{path}: damaged PCD header: no DATA line")
        words = line.decode("ascii", errors="replace").split("#")[0].split()
        if words:
            header[words[0]] = words[1:]
    return header


@dataclass(frozen=True)
class _Field:
    """A field: the type of its values, how many each point has, and where in a point it starts,
    in bytes and in values."""

    name: str
    kind: np.dtype
    repeat: int
    offset: int
    place: int


def _read_columns(file: BinaryIO, header: dict[str, list[str]]) -> dict[str, np.ndarray]:
    """The first value of every field (n,) that a cloud has a use for, by name."""
    count, fields = _count(header), _fields(header)
    row = fields[-1].offset + fields[-1].repeat * fields[-1].kind.itemsize
    width = fields[-1].place + fields[-1].repeat
    used = [field for field in fields if field.name in USED_COLUMNS]
    left = os.fstat(file.fileno()).st_size - file.tell()
    data = header["DATA"][0]
    if data == "ascii":
        return _read_text(file, used, count, width, left)
    if data == "binary":
        _check_length(left // row, count)
        names = [field.name for field in used]
        layout = {
            "names": names,
            "formats": [field.kind for field in used],
            "offsets": [field.offset for field in used],
            "itemsize": row,
        }
        parts = binary_parts(file, np.dtype(layout), count)  # type: ignore[call-overload]
        return gather(parts, count, names)
    if data == "binary_compressed":
        return _read_compressed(file, used, count, row, left)
    raise ValueError(f"DATA {data} is not known; known: ascii, binary, binary_compressed")


def _count(header: dict[str, list[str]]) -> int:
    count = int(header["POINTS"][0])
    if not 0 <= count <= MAX_POINTS:
        raise ValueError(f"{count} points; at most {MAX_POINTS} are read")
    if "WIDTH" in header and "HEIGHT" in header:
        width, height = int(header["WIDTH"][0]), int(header["HEIGHT"][0])
        if width * height != count:
            raise ValueError(f"WIDTH {width} times HEIGHT {height} is not POINTS {count}")
    return count


def _fields(header: dict[str, list[str]]) -> list[_Field]:
    fields: list[_Field] = []
    offset = place = 0
    repeats = header.get("COUNT", ["1"] * len(header["FIELDS"]))
    for name, letter, size, count in zip(
        header["FIELDS"], header["TYPE"], header["SIZE"], repeats, strict=True
    ):
        if letter not in _SIZES or size not in _SIZES[letter]:
            raise ValueError(f"field {name}: TYPE {letter} of SIZE {size} is not known")
        kind, repeat = np.dtype(f"<{letter.lower()}{size}"), int(count)
        if repeat < 1:
            raise ValueError(f"field {name} has COUNT {repeat}")
        fields.append(_Field(name, kind, repeat, offset, place))
        offset, place = offset + repeat * kind.itemsize, place + repeat
    if not fields or offset > _LONGEST_ROW:
        raise ValueError(f"a point of {offset} bytes; 1 to {_LONGEST_ROW} are read")
    names = [field.name for field in fields if field.name in USED_COLUMNS]
    if len(set(names)) != len(names):
        raise ValueError("a field is named twice")
    return fields


def _read_text(
    file: BinaryIO, used: list[_Field], count: int, width: int, left: int
) -> dict[str, np.ndarray]:
    start = file.tell()
    _check_length(count_rows(file, count), count)
    file.seek(start)
    if 2 * width * count > left + 1:  # each value takes a digit, and a space or a line end
        raise ValueError(f"truncated: {count} points of {width} values are more than it holds")
    columns = {field.name: np.empty(count, field.kind) for field in used}
    for first, part in text_parts(file, count, width):
        for field in used:
            values = part[:, field.place]
            if field.kind.kind in "iu":
                limits = np.iinfo(field.kind)
                whole = (values == np.floor(values)) & (values <= limits.max)
                if not (whole & (values >= limits.min)).all():
                    raise ValueError(
                        f"field {field.name} is declared as {field.kind.name}, but has other "
                        "values: its TYPE or SIZE is wrong"
                    )
            with np.errstate(over="ignore"):
                columns[field.name][first : first + len(part)] = values
    return columns


def _read_compressed(
    file: BinaryIO, used: list[_Field], count: int, row: int, left: int
) -> dict[str, np.ndarray]:
    sizes = file.read(8)
    if len(sizes) < 8:
        raise ValueError("truncated: nothing follows DATA binary_compressed")
    packed, size = (int(v) for v in np.frombuffer(sizes, "<u4"))
    if size != count * row:
        raise ValueError(f"{size} bytes do not make {count} points of {row} bytes")
    if packed > left - 8 or size > _LZF_BEST * packed:
        raise ValueError(f"truncated: no {size} bytes come of {min(packed, left - 8)}")
    if size > MAX_UNPACKED_BYTES:
        raise ValueError(
            f"it unpacks to {size / 1e9:.1f} GB; at most {MAX_UNPACKED_BYTES / 1e9:g} GB are read: "
            "write it with DATA binary"
        )
    raw = np.frombuffer(decompress_lzf(file.read(packed), size), np.uint8)
    columns = {}
    for field in used:  # one field after another, not one point after another
        start = count * field.offset
        end = start + count * field.repeat * field.kind.itemsize
        columns[field.name] = raw[start:end].view(field.kind)[:: field.repeat].copy()
    return columns


def _check_length(found: int, count: int) -> None:
    if found < count:
        raise ValueError(f"truncated: {found} of {count} points")
    if found > count:
        raise ValueError(f"it holds more than the {count} points that its header claims")


def decompress_lzf(packed: bytes, size: int) -> bytearray:
    """Undo LZF compression (Lehmann's libLZF), as PCD files use it.

    A control byte below 32 is followed by that many bytes and one more, as they are; others carry
    the length (upper three bits, and a further byte if all are set) and distance of a repetition
    of what came before. Raises ValueError unless exactly `size` bytes come out.
    """
    out = bytearray()
    place, end = 0, len(packed)
    try:
        while place < end and len(out) <= size:
            control = packed[place]
            place += 1
            if control < 32:
                out += packed[place : place + control + 1]
                place += control + 1
                continue
            length = control >> 5
            if length == 7:
                length += packed[place]
                place += 1
            start = len(out) - ((control & 31) << 8) - packed[place] - 1
            place += 1
            length += 2
            if start < 0:
                raise ValueError("damaged: it repeats what was not there")
            piece = out[start : start + length]
            # A repetition may run into what it is writing.
            out += (piece * (length // len(piece) + 1))[:length]
    except IndexError:
        raise ValueError("truncated within its compressed data") from None
    if len(out) != size or place > end:
        raise ValueError(f"truncated: its compressed data give {len(out)} of {size} bytes")
    return out
