"""Clouds as tables of numbers: NPY, NPZ, and text in columns."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from nrdf import ply
from nrdf.errors import CloudError
from nrdf.formats.raw import RawCloud, colours_of, intensity_of, stack
from nrdf.units import METRES

_ALIASES = {"r": "red", "g": "green", "b": "blue", "normal_x": "nx", "normal_y": "ny"} | {
    "normal_z": "nz"
}
_MOST_COLUMNS = 16


def read_npy(path: Path, _: int) -> RawCloud:
    """A numeric array (n, 3 or more)."""
    try:
        return _from_table(path, np.load(path, allow_pickle=False, mmap_mode="r"))
    except (ValueError, EOFError) as error:
        raise CloudError(f"{path}: truncated or not a plain NumPy array ({error})") from error


def read_npz(path: Path, _: int) -> RawCloud:
    """Arrays `points` and, where there are any, `normals`, `colours`, `intensity`, `sensors` (s, 3)
    and the words `unit` and `frame`."""
    try:
        with zipfile.ZipFile(path) as archive:
            if max((i.file_size for i in archive.infolist()), default=0) > 48 * ply.MOST_POINTS:
                raise CloudError(f"{path}: an array of it has more than {ply.MOST_POINTS} points")
        with np.load(path, allow_pickle=False) as arrays:
            prefix = "" if "points" in arrays else "pointcloud/"
            if f"{prefix}points" not in arrays:
                raise CloudError(
                    f"{path}: no array 'points' (n, 3); this file has: {', '.join(arrays.files)}"
                )
            found = {
                name.removeprefix(prefix): arrays[name]
                for name in arrays.files
                if name.startswith(prefix)
            }
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise CloudError(f"{path}: truncated or not plain NumPy arrays ({error})") from error
    cloud = _from_table(path, found["points"])
    cloud.normals = found.get("normals", cloud.normals)
    colours = found.get("colours", found.get("colors"))
    if colours is not None and colours.ndim == 2:
        cloud.colours = colours_of(dict(zip(("red", "green", "blue"), colours.T, strict=False)))
    cloud.intensity = found.get("intensity", cloud.intensity)
    unit = str(found.get("unit", ""))
    cloud.unit = unit if unit in METRES else None
    cloud.frame = str(found["frame"]) if "frame" in found else None
    sensors = found.get("sensors", cloud.sensors)
    if sensors.ndim != 2 or sensors.shape[1] != 3 or sensors.dtype.kind not in "fiu":
        raise CloudError(f"{path}: 'sensors' must be places (s, 3), not {sensors.shape}")
    cloud.sensors = sensors.astype(np.float64)
    return cloud


def _from_table(path: Path, table: np.ndarray) -> RawCloud:
    """Columns 4 to 6 are normals if they are unit vectors, colours if whole numbers of 0 to 255;
    a fourth column alone is intensity."""
    if table.ndim != 2 or table.shape[1] < 3 or table.dtype.kind not in "fiu":
        raise CloudError(
            f"{path}: a numeric table (n, 3), or (n, 6) with normals, is needed; this one is "
            f"{table.shape} of {table.dtype}"
        )
    table = np.asarray(table[:, :6], dtype=np.float64)
    cloud, rest = RawCloud(table[:, :3]), table[:, 3:]
    if rest.shape[1] == 1:
        cloud.intensity = rest[:, 0].astype(np.float32)
    if rest.shape[1] == 3 and len(table) > 0:
        if (np.abs((rest**2).sum(axis=1) - 1.0) < 0.02).mean() > 0.95:
            cloud.normals = rest
        elif ((rest >= 0) & (rest <= 255) & (rest == np.round(rest))).all():
            cloud.colours = rest.astype(np.uint8)
    return cloud


def read_text(path: Path, _: int) -> RawCloud:
    """Rows of numbers divided by spaces, tabs, commas or semicolons.

    A heading that names as many columns as there are (x y z nx ny nz red green blue intensity) is
    followed; other headings are skipped.
    """
    skip, delimiter, wide = 0, None, 0
    names: list[str] = []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            body = line.split("#")[0].split("//")[0].strip()
            delimiter = "," if "," in line else ";" if ";" in line else None
            words = [word for word in body.split(delimiter) if word.strip()]
            try:
                wide = len([float(word) for word in words])
            except ValueError:
                wide = 0
            if wide >= 3:
                break
            heading = line.strip().strip("#/").lower().split(delimiter)
            names = [word.strip().strip('"') for word in heading] or names
            skip += 1
            if skip > 100 or (skip > 1 and body and not wide):
                break
        if wide < 3:
            raise CloudError(f"{path}: not a point cloud: rows of three or more numbers are needed")
    names = [_ALIASES.get(name, name) for name in names]
    named = len(names) == wide and {"x", "y", "z"} <= set(names) and len(set(names)) == wide
    try:
        table = np.loadtxt(
            path, skiprows=skip, delimiter=delimiter, ndmin=2, comments=["#", "//"],
            encoding="utf-8", usecols=tuple(range(min(wide, _MOST_COLUMNS if named else 6))),
        )  # fmt: skip
    except ValueError as error:
        raise CloudError(f"{path}: not a table of numbers: {error}") from error
    columns = {name: table[:, i] for i, name in enumerate(names[:_MOST_COLUMNS])} if named else {}
    points = stack(columns, "xyz")
    if points is None:
        return _from_table(path, table)
    return RawCloud(
        points,
        stack(columns, ("nx", "ny", "nz")),
        colours=colours_of(columns),
        intensity=intensity_of(columns),
    )
