"""Clouds as text in columns, and what the columns of a table of numbers without names are."""

from __future__ import annotations

import io
import logging
import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from nrdf.errors import CloudError
from nrdf.geometry.units import METRES, parse_unit
from nrdf.io.files import open_file
from nrdf.io.formats.raw import RawCloud, colours_of, intensity_of, stack

logger = logging.getLogger(__name__)

_ALIASES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny"} | {
    "normal_z": "nz"
}
_MOST_COLUMNS = 16
_LONGEST_LINE = 1 << 16
_LONGEST_HEADING = 100  # lines
_BOM = b"\xef\xbb\xbf"
_PLACE = r"(?:position|pos|coordinate|coord|points?)"
_AXIS = re.compile(rf"(?:{_PLACE}[\s_.:-]*)?([xyz])(?:[\s_.:-]*{_PLACE})?")
_UNIT = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")  # x [mm], Y(cm)
_SUFFIX = re.compile(r"(.*[xyz])[\s_](mm|cm|m|in)")  # x_mm


def table_cloud(path: Path, table: np.ndarray) -> RawCloud:
    """A table (n, 3 to 6) of numbers whose columns have no names: points first.

    Columns 4 to 6 are normals if they are unit vectors, colours if whole numbers of 0 to 255;
    a fourth column alone is intensity.
    """
    cloud, rest = RawCloud(table[:, :3]), table[:, 3:]
    if rest.shape[1] == 1:
        with np.errstate(over="ignore"):
            cloud.intensity = rest[:, 0].astype(np.float32)
    if rest.shape[1] == 3 and len(table) > 0:
        with np.errstate(over="ignore", invalid="ignore"):
            unit_length = (np.abs((rest**2).sum(axis=1) - 1.0) < 0.02).mean() > 0.95
        if unit_length:
            cloud.normals = rest
        elif ((rest >= 0) & (rest <= 255) & (rest == np.round(rest))).all():
            cloud.colours = rest.astype(np.uint8)
    return cloud


def read_text(path: Path, _: int) -> RawCloud:
    """Rows of numbers divided by spaces, tabs, commas or semicolons.

    A heading that names as many columns as there are (x y z nx ny nz red green blue intensity, in
    any order, the coordinates perhaps with their unit: ``x [mm]``) is followed; one without x, y
    and z is skipped. A number alone above the rows of a PTS file is how many they are.
    """
    with open_file(path, CloudError) as file:
        if file.read(len(_BOM)) != _BOM:
            file.seek(0)
        start = _find_rows(path, file)
        file.seek(start.at)
        columns = _columns(path, start)
        width = min(start.width, _MOST_COLUMNS if columns else 6)
        try:
            table = np.loadtxt(
                io.TextIOWrapper(file, encoding="utf-8"),  # type: ignore[type-var]
                delimiter=start.delimiter, ndmin=2, comments=["#", "//"],
                usecols=None if width == start.fields else tuple(range(width)),
            )  # fmt: skip
        except ValueError as error:
            raise CloudError(f"{path}: not a table of numbers: {error}") from error
    if start.count is not None and start.count != len(table):
        raise CloudError(
            f"{path}: its first line claims {start.count} points, but {len(table)} rows follow: "
            "truncated or damaged; export it again"
        )
    if columns is None:
        return table_cloud(path, table)
    named = {name: table[:, i] for i, name in enumerate(columns.names[:width])}
    points = stack(named, "xyz")
    if points is None:
        raise CloudError(f"{path}: x, y and z must be among its first {width} columns")
    with np.errstate(over="ignore"):
        return RawCloud(
            points * columns.scale,
            stack(named, ("nx", "ny", "nz")),
            unit=columns.unit,
            colours=colours_of(named),
            intensity=intensity_of(named),
        )


@dataclass
class _Start:
    """Where the rows begin: place in the file; numbers in the first row, and fields, where what
    follows the last delimiter counts too; the last heading above; the count that a PTS begins
    with."""

    at: int
    width: int
    fields: int
    delimiter: str | None
    heading: str
    count: int | None


def _find_rows(path: Path, file: BinaryIO) -> _Start:
    heading, count = "", None
    for number in range(_LONGEST_HEADING + 1):
        at = file.tell()
        raw = file.readline(_LONGEST_LINE)
        if not raw:
            break
        line = raw.decode("utf-8", errors="replace")
        body = line.split("#")[0].split("//")[0].strip()
        delimiter = "," if "," in line else ";" if ";" in line else None
        parts = body.split(delimiter)
        words = [word for word in parts if word.strip()]
        numbers = _numbers(words)
        if len(numbers) >= 3:
            return _Start(at, len(numbers), len(parts), delimiter, heading, count)
        numeric = sum(bool(_numbers([word])) for word in words)
        if len(words) >= 3 and 2 * numeric >= len(words):
            raise CloudError(f"{path}: damaged row '{body[:60]}': numbers are needed")
        if number == 0 and path.suffix.lower() == ".pts" and body.isdecimal():
            count = int(body) if len(body) < 20 else -1
        elif line.strip():
            heading = line
        if number > 0 and body and not numbers:
            break
    raise CloudError(f"{path}: not a point cloud: rows of three or more numbers are needed")


def _numbers(words: list[str]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        return []


@dataclass
class _Columns:
    """Names of the columns; the points' unit, and the factors (3,) that bring them to it."""

    names: list[str]
    unit: str | None
    scale: np.ndarray


def _columns(path: Path, start: _Start) -> _Columns | None:
    """What the heading says of the columns; None if it names no x, y and z.

    Raises CloudError for a heading that names the axes and cannot be followed.
    """
    heading = re.sub(r"\s+(?=[\[(])", "", start.heading.strip().strip("#/").lower())
    delimiter = "," if "," in heading else ";" if ";" in heading else None
    names, units = [], {}
    for word in heading.split(delimiter):
        word = word.strip().strip("\"'").strip()
        found = _UNIT.fullmatch(word) or _SUFFIX.fullmatch(word)
        word, unit = found.groups() if found else (word, "")
        axis = _AXIS.fullmatch(word)
        name = axis[1] if axis else _ALIASES.get(word, word)
        names.append(name)
        if axis:
            units[name] = unit
    while names and not names[-1]:
        names.pop()
    if not units:
        if len(names) == start.width and not _numbers(names):
            logger.warning(
                "%s: its heading '%s' names no x, y and z: the first three columns are taken",
                path, start.heading.strip()[:80],
            )  # fmt: skip
        return None
    if len(units) < 3:
        raise CloudError(
            f"{path}: its heading '{start.heading.strip()[:80]}' names {' and '.join(units)} "
            "alone: name x, y and z, or leave the heading out"
        )
    if len(names) != start.width or len(set(names)) != len(names):
        raise CloudError(
            f"{path}: its heading names {len(names)} columns ({', '.join(names)[:80]}), but the "
            f"rows have {start.width}: name each column once, or leave the heading out"
        )
    if not any(units.values()):
        return _Columns(names, None, np.ones(3))
    known = [parse_unit(units[axis]) for axis in "xyz"]
    lengths = [METRES[unit] for unit in known if unit is not None]
    if len(lengths) < 3:
        said = ", ".join(f"{axis} [{units[axis]}]" for axis in "xyz")
        raise CloudError(
            f"{path}: the units in its heading, {said}, are not all known ({', '.join(METRES)})"
        )
    return _Columns(names, known[0], np.array(lengths) / lengths[0])
