"""The Point Cloud Library's PCD format: DATA ascii, binary and binary_compressed (LZF)."""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO

import numpy as np

from nrdf import ply
from nrdf.errors import CloudError
from nrdf.formats.raw import RawCloud, colours_of, intensity_of, stack

_LONGEST_HEADER = 1 << 16


def read_pcd(path: Path, _: int) -> RawCloud:
    """Points, normals, colours and intensity; VIEWPOINT says where the sensor stood.

    A viewpoint at the origin counts as known only in a grid (HEIGHT above 1), where the camera's
    own frame is the usual one: the origin is also what writers put where they know nothing.
    """
    with open(path, "rb") as file:
        said = _read_header(path, file)
        try:
            columns = _read_columns(file, said)
        except (KeyError, ValueError, IndexError, TypeError, EOFError) as error:
            raise CloudError(f"{path}: cannot read this PCD file: {error}") from error
    points = stack(columns, "xyz")
    if points is None:
        raise CloudError(
            f"{path}: fields x, y and z are needed; it has {', '.join(said['FIELDS'])}"
        )
    sensors: np.ndarray = np.empty((0, 3))
    try:
        pose = np.array([float(word) for word in said.get("VIEWPOINT", [])])
        grid = int(said.get("HEIGHT", ["1"])[0]) > 1
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
    said: dict[str, list[str]] = {}
    while "DATA" not in said:
        line = file.readline(4096)
        if not line or file.tell() > _LONGEST_HEADER:
            raise CloudError(f"{path}: damaged PCD header: no DATA line")
        words = line.decode("ascii", errors="replace").split("#")[0].split()
        if words:
            said[words[0]] = words[1:]
    return said


def _read_columns(file: BinaryIO, said: dict[str, list[str]]) -> dict[str, np.ndarray]:
    """The first value of every field (n,), by name."""
    fields = said["FIELDS"]
    count = int(said["POINTS"][0])
    repeats = [int(c) for c in said.get("COUNT", ["1"] * len(fields))]
    kinds = ["<" + t.lower() + s for t, s in zip(said["TYPE"], said["SIZE"], strict=True)]
    if not 0 <= count <= ply.MOST_POINTS or len(fields) != len(kinds):
        raise ValueError(f"{count} points of {len(fields)} fields")
    layout = [(f"{i}", k, (c,)) for i, (k, c) in enumerate(zip(kinds, repeats, strict=True))]
    row = np.dtype(layout)
    data = said["DATA"][0]
    if data == "ascii":
        table = np.loadtxt(file, max_rows=count, ndmin=2, comments=None)
        _check_length(len(table), count)
        first = np.concatenate([[0], np.cumsum(repeats)[:-1]])
        return {
            name: table[:, i].astype(kind)
            for name, kind, i in zip(fields, kinds, first, strict=True)
        }
    if data == "binary":
        raw = np.frombuffer(file.read(count * row.itemsize), np.uint8)
        _check_length(len(raw) // row.itemsize, count)
        rows = raw.view(row)
        return {name: rows[f"{i}"][:, 0] for i, name in enumerate(fields)}
    if data == "binary_compressed":
        sizes = file.read(8)
        if len(sizes) < 8:
            raise ValueError("truncated: nothing follows DATA binary_compressed")
        packed, size = (int(v) for v in np.frombuffer(sizes, "<u4"))
        if size != count * row.itemsize:
            raise ValueError(f"{size} bytes do not make {count} points of {row.itemsize} bytes")
        raw = np.frombuffer(decompress_lzf(file.read(packed), size), np.uint8)
        columns, start = {}, 0
        # One field after another, not one point after another.
        for name, (_, kind, (repeat,)) in zip(fields, layout, strict=True):
            length = count * repeat * np.dtype(kind).itemsize
            columns[name] = raw[start : start + length].view(kind)[::repeat]
            start += length
        return columns
    raise ValueError(f"DATA {data} is not known; known: ascii, binary, binary_compressed")


def _check_length(found: int, count: int) -> None:
    if found != count:
        raise ValueError(f"truncated: {found} of {count} points")


def decompress_lzf(packed: bytes, size: int) -> bytes:
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
    return bytes(out)
