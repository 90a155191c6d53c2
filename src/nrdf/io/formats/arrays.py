"""NumPy's files, NPY and NPZ: shape and type of an array are checked before it is loaded."""

from __future__ import annotations

import math
import os
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from nrdf.errors import CloudError, NrdfError
from nrdf.geometry.units import METRES, parse_unit
from nrdf.io.files import open_file
from nrdf.io.formats.raw import MAX_UNPACKED_BYTES, RawCloud, colours_of
from nrdf.io.formats.tables import table_cloud
from nrdf.io.rows import MAX_POINTS

Head = tuple[tuple[int, ...], np.dtype]
_MAX_WORD = 1024  # bytes of a unit or frame
_MAX_SENSORS = 100_000


def read_npy(path: Path, _: int) -> RawCloud:
    """A numeric array (n, 3 or more)."""
    with open_file(path, CloudError) as file:
        try:
            shape, kind = array_head(file, os.fstat(file.fileno()).st_size)
            _check_table(shape, kind)
            table = np.load(path, mmap_mode="r", allow_pickle=False)[:, :6]
            return table_cloud(path, np.asarray(table, np.float64))
        except (ValueError, EOFError) as error:
            raise CloudError(f"{path}: truncated or not a plain NumPy array: {error}") from error


def read_npz(path: Path, _: int) -> RawCloud:
    """Arrays `points` and, where there are any, `normals`, `colours`, `intensity`, `sensors` (s, 3)
    and the words `unit` and `frame`."""
    with open_arrays(path, CloudError) as arrays:
        prefix = "" if "points" in arrays.names else "pointcloud/"
        if f"{prefix}points" not in arrays.names:
            raise CloudError(
                f"{path}: no array 'points' (n, 3); this file has: {', '.join(arrays.names)}"
            )
        shape, kind = arrays.head(f"{prefix}points")
        _check_table(shape, kind)
        cloud = table_cloud(path, np.asarray(arrays.load(f"{prefix}points"), np.float64)[:, :6])
        for name in ("normals", "colours", "colors", "intensity", "sensors"):
            if f"{prefix}{name}" in arrays.names:
                _check_part(name, *arrays.head(f"{prefix}{name}"), len(cloud.points))
                _add(cloud, name, arrays.load(f"{prefix}{name}"))
        for name in ("unit", "frame"):
            if f"{prefix}{name}" in arrays.names:
                shape, kind = arrays.head(f"{prefix}{name}")
                if shape != () or kind.kind != "U" or kind.itemsize > _MAX_WORD:
                    raise ValueError(f"'{name}' must be a word, not {shape} of {kind}")
                setattr(cloud, name, str(arrays.load(f"{prefix}{name}")))
        if cloud.unit and parse_unit(cloud.unit) is None:
            raise ValueError(f"its unit is '{cloud.unit}'; known: {', '.join(METRES)}")
        cloud.unit = parse_unit(cloud.unit or "")
    return cloud


def _check_table(shape: tuple[int, ...], kind: np.dtype) -> None:
    if len(shape) != 2 or shape[1] < 3 or kind.kind not in "fiu":
        raise ValueError(
            f"a numeric table (n, 3), or (n, 6) with normals, is needed; this one is {shape} of "
            f"{kind}"
        )
    if shape[0] > MAX_POINTS:
        raise ValueError(f"it has {shape[0]} points; at most {MAX_POINTS} are read")


def _check_part(name: str, shape: tuple[int, ...], kind: np.dtype, count: int) -> None:
    """Whether an array of the points' normals, colours or the like has the shape that it needs."""
    wanted = {"intensity": "(n,)", "sensors": "(s, 3)"}.get(name, "(n, 3)")
    fits = {
        "intensity": shape == (count,),
        "sensors": len(shape) == 2 and shape[1] == 3 and shape[0] <= _MAX_SENSORS,
        "normals": shape == (count, 3),
    }.get(name, shape in ((count, 3), (count, 4)))
    if not fits or kind.kind not in "fiu":
        raise ValueError(
            f"'{name}' must be numbers {wanted} for n = {count} points, not {shape} of {kind}"
        )


def _add(cloud: RawCloud, name: str, values: np.ndarray) -> None:
    if name in ("colours", "colors"):
        cloud.colours = colours_of(dict(zip(("red", "green", "blue"), values.T, strict=False)))
    elif name == "intensity":
        with np.errstate(over="ignore"):
            cloud.intensity = values.astype(np.float32)
    else:
        setattr(cloud, name, values.astype(np.float64))


def array_head(file: BinaryIO, size: int) -> Head:
    """Shape and type of the array in an NPY file of `size` bytes; reads its header only.

    Raises ValueError if the header is damaged, holds Python objects or records, or claims more than
    the file holds.
    """
    readers = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    with _library_errors():
        version = np.lib.format.read_magic(file)
        if version not in readers:
            raise ValueError(f"version {version} of the format, or records; plain numbers are read")
        shape, _, kind = readers[version](file)
    if kind.hasobject or kind.names is not None or kind.subdtype is not None:
        raise ValueError(f"plain numbers are needed, not {kind}")
    if min(shape, default=0) < 0 or math.prod(shape) * kind.itemsize > size - file.tell():
        raise ValueError(f"truncated: {shape} of {kind} is more than the file holds")
    return shape, kind


class Arrays:
    """The arrays of an open NPZ file; each is known by its `head` before it is loaded.

    ValueError says that one of them is damaged, encrypted, or packed in a way that is not known.
    """

    def __init__(self, file: BinaryIO) -> None:
        with _library_errors():
            self._archive = zipfile.ZipFile(file)
        self._members = {
            info.filename.removesuffix(".npy"): info
            for info in self._archive.infolist()
            if info.filename.endswith(".npy")
        }
        self._left = MAX_UNPACKED_BYTES

    @property
    def names(self) -> list[str]:
        """Names of the arrays, in the file's order."""
        return list(self._members)

    def head(self, name: str) -> Head:
        """Shape and type of an array."""
        info = self._members[name]
        with _library_errors(), self._archive.open(info) as file:
            return array_head(cast(BinaryIO, file), info.file_size)

    def load(self, name: str) -> np.ndarray:
        """An array. Raises ValueError also if all that were loaded get too large."""
        shape, kind = self.head(name)
        self._left -= math.prod(shape) * kind.itemsize
        if self._left < 0:
            raise ValueError(
                f"its arrays unpack to more than {MAX_UNPACKED_BYTES / 1e9:g} GB; thin the "
                "cloud, or write it as PLY"
            )
        with _library_errors(), self._archive.open(self._members[name]) as file:
            return np.lib.format.read_array(file, allow_pickle=False)


@contextmanager
def open_arrays(path: Path, error: type[NrdfError]) -> Iterator[Arrays]:
    """The arrays of an NPZ file, while the block lasts.

    Raises `error` for what is no regular file or no archive, and for a ValueError in the block.
    """
    with open_file(path, error) as file:
        try:
            yield Arrays(file)
        except ValueError as problem:
            raise error(f"{path}: truncated or not plain NumPy arrays: {problem}") from problem


@contextmanager
def _library_errors() -> Iterator[None]:
    """Raise whatever zipfile, its decompressors and NumPy raise as ValueError."""
    try:
        yield
    except ValueError:
        raise
    except Exception as error:
        raise ValueError(str(error) or type(error).__name__) from error
