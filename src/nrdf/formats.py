"""The file formats that point clouds come in, each read by a function of its own.

Every reader takes the path and the number of points to sample if the file holds a mesh, and raises
CloudError if the file is truncated, damaged or not what it says it is.
"""

from __future__ import annotations

import logging
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from nrdf import ply
from nrdf.errors import CloudError, DataError
from nrdf.units import METRES

logger = logging.getLogger(__name__)

KNOWN_FORMATS = "PLY, XYZ/TXT/CSV/ASC/PTS, PCD, NPY, NPZ, OFF, OBJ, STL"


@dataclass
class RawCloud:
    """What a file holds, unchecked: points (n, 3), normals (n, 3) or None, unit, frame."""

    points: np.ndarray
    normals: np.ndarray | None = None
    unit: str | None = None
    frame: str | None = None


def reader_of(path: Path, start: bytes) -> Callable[[Path, int], RawCloud]:
    """Reader for the file `path` that begins with the bytes `start`.

    Raises CloudError, listing the known formats, if there is none.
    """
    ending = path.suffix.lower()
    if start.startswith((b"ply\n", b"ply\r")):
        return _read_ply
    if start.startswith(b"\x93NUMPY"):
        return _read_npy
    if start.startswith(b"PK\x03\x04") and ending == ".npz":
        return _read_npz
    if ending == ".pcd" or start.startswith(b"# .PCD"):
        return _read_pcd
    if ending == ".off" or start.split(b"\n", 1)[0].strip() in (b"OFF", b"COFF", b"NOFF"):
        return _read_off
    if ending == ".obj":
        return _read_obj
    if ending == ".stl":
        return _read_mesh
    text = b"\0" not in start
    if ending in (".xyz", ".xyzn", ".txt", ".csv", ".asc", ".pts") and text:
        return _read_text
    raise CloudError(f"{path}: not a point cloud that can be read; known formats: {KNOWN_FORMATS}")


def _read_ply(path: Path, mesh_samples: int) -> RawCloud:
    header = ply.read_header(path)
    said = dict(c.split(" ", 1) for c in header.comments if c.startswith(("unit ", "frame ")))
    unit = said.get("unit", "").strip()
    if header.count("face") and mesh_samples:
        cloud = _read_mesh(path, mesh_samples)
    else:
        columns = ply.read_scalars(path, header)
        points = _columns(columns, "xyz")
        if points is None:
            raise CloudError(
                f"{path}: its vertices have the properties {', '.join(columns) or '(none)'}; "
                "x, y and z are needed"
            )
        cloud = RawCloud(points, _columns(columns, ("nx", "ny", "nz")))
    return replace(cloud, unit=unit if unit in METRES else None, frame=said.get("frame"))


def _columns(columns: Mapping[str, np.ndarray], names: str | tuple[str, ...]) -> np.ndarray | None:
    if any(name not in columns for name in names):
        return None
    return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def _read_npy(path: Path, _: int) -> RawCloud:
    try:
        return _from_table(path, np.load(path, allow_pickle=False, mmap_mode="r"))
    except (ValueError, EOFError) as error:
        raise CloudError(f"{path}: truncated or not a plain NumPy array ({error})") from error


def _read_npz(path: Path, _: int) -> RawCloud:
    try:
        with zipfile.ZipFile(path) as archive:
            if max((i.file_size for i in archive.infolist()), default=0) > 48 * ply.MOST_POINTS:
                raise CloudError(f"{path}: an array of it has more than {ply.MOST_POINTS} points")
        with np.load(path, allow_pickle=False) as arrays:
            for prefix in ("", "pointcloud/"):
                if f"{prefix}points" in arrays:
                    points = _from_table(path, arrays[f"{prefix}points"])
                    if f"{prefix}normals" in arrays:
                        return RawCloud(points.points, arrays[f"{prefix}normals"])
                    return points
            raise CloudError(
                f"{path}: no array 'points' (n, 3); this file has: {', '.join(arrays.files)}"
            )
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise CloudError(f"{path}: truncated or not plain NumPy arrays ({error})") from error


def _from_table(path: Path, table: np.ndarray) -> RawCloud:
    """Points, and normals if columns 4 to 6 are unit vectors, of a table (n, 3 or more)."""
    if table.ndim != 2 or table.shape[1] < 3 or table.dtype.kind not in "fiu":
        raise CloudError(
            f"{path}: a numeric table (n, 3), or (n, 6) with normals, is needed; this one is "
            f"{table.shape} of {table.dtype}"
        )
    table = np.asarray(table[:, :6], dtype=np.float64)
    normals = table[:, 3:]
    # Six columns may as well be colours: only unit vectors are normals.
    is_unit = normals.shape[1] == 3 and len(table) > 0
    is_unit = is_unit and bool((np.abs((normals**2).sum(axis=1) - 1.0) < 0.02).mean() > 0.95)
    return RawCloud(table[:, :3], normals if is_unit else None)


def _read_text(path: Path, _: int) -> RawCloud:
    """Rows of numbers divided by spaces, tabs, commas or semicolons; headings are skipped."""
    skip, delimiter, wide = 0, None, 0
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            body = line.split("#")[0].split("//")[0].strip()
            delimiter = "," if "," in body else ";" if ";" in body else None
            words = [word for word in body.split(delimiter) if word.strip()]
            try:
                wide = len([float(word) for word in words])
            except ValueError:
                wide = 0
            if wide >= 3:
                break
            skip += 1
            if skip > 100 or (skip > 1 and body and not wide):
                break
        if wide < 3:
            raise CloudError(
                f"{path}: not a point cloud: rows of three or more numbers are needed; "
                f"known formats: {KNOWN_FORMATS}"
            )
    columns = tuple(range(min(wide, 6)))
    try:
        table = np.loadtxt(
            path, skiprows=skip, delimiter=delimiter, usecols=columns, ndmin=2,
            comments=["#", "//"], encoding="utf-8",
        )  # fmt: skip
    except ValueError as error:
        raise CloudError(f"{path}: not a table of numbers: {error}") from error
    return _from_table(path, table)


def _read_pcd(path: Path, _: int) -> RawCloud:
    """Point Cloud Library's format, DATA ascii or binary."""
    said: dict[str, list[str]] = {}
    with open(path, "rb") as file:
        while "DATA" not in said:
            line = file.readline(4096)
            if not line or file.tell() > 65536:
                raise CloudError(f"{path}: damaged PCD header: no DATA line")
            words = line.decode("ascii", errors="replace").split("#")[0].split()
            if words:
                said[words[0]] = words[1:]
        try:
            fields = said["FIELDS"]
            count = int(said["POINTS"][0])
            repeats = [int(c) for c in said.get("COUNT", ["1"] * len(fields))]
            kinds = [t.lower() + s for t, s in zip(said["TYPE"], said["SIZE"], strict=True)]
            row = np.dtype(
                [
                    (f"{i}", "<" + k, (c,))
                    for i, (k, c) in enumerate(zip(kinds, repeats, strict=True))
                ]
            )
            data = said["DATA"][0]
            if not 0 <= count <= ply.MOST_POINTS or len(fields) != len(kinds):
                raise ValueError(f"{count} points of {len(fields)} fields")
            if data == "ascii":
                table: np.ndarray = np.loadtxt(file, max_rows=count, ndmin=2, comments=None)
                first = np.concatenate([[0], np.cumsum(repeats)[:-1]])
                columns = {name: table[:, i] for name, i in zip(fields, first, strict=True)}
            elif data == "binary":
                raw = np.frombuffer(file.read(), np.uint8)[: count * row.itemsize]
                rows = raw[: len(raw) // row.itemsize * row.itemsize].view(row)
                table = rows
                columns = {name: rows[f"{i}"][:, 0] for i, name in enumerate(fields)}
            else:
                raise ValueError(f"DATA {data} is not read; save it as DATA binary")
            if len(table) != count:
                raise ValueError(f"truncated: {len(table)} of {count} points")
        except (KeyError, ValueError, IndexError, TypeError) as error:
            raise CloudError(f"{path}: cannot read this PCD file: {error}") from error
    points = _columns(columns, "xyz")
    if points is None:
        raise CloudError(f"{path}: fields x, y and z are needed; it has {', '.join(fields)}")
    return RawCloud(points, _columns(columns, ("normal_x", "normal_y", "normal_z")))


def _read_off(path: Path, mesh_samples: int) -> RawCloud:
    with open(path, "rb") as file:
        words: list[bytes] = []
        while len(words) < 4:
            line = file.readline(4096)
            if not line:
                raise CloudError(f"{path}: damaged OFF header: no counts")
            words += line.split(b"#")[0].split()
            if words and not words[0].endswith(b"OFF"):
                raise CloudError(f"{path}: not an OFF file: it does not begin with OFF")
        try:
            points, faces = int(words[1]), int(words[2])
            if faces and mesh_samples:
                return _read_mesh(path, mesh_samples)
            if not 0 <= points <= path.stat().st_size // 6 + 1:
                raise ValueError(f"truncated: {points} points are more than the file holds")
            table = np.loadtxt(file, max_rows=points, usecols=(0, 1, 2), ndmin=2)
            if len(table) != points:
                raise ValueError(f"truncated: {len(table)} of {points} points")
        except ValueError as error:
            raise CloudError(f"{path}: damaged OFF file: {error}") from error
    return RawCloud(table)


def _read_obj(path: Path, mesh_samples: int) -> RawCloud:
    vertices: list[list[float]] = []
    with open(path, encoding="utf-8", errors="replace") as file:
        for line in file:
            if mesh_samples and line.startswith("f "):
                return _read_mesh(path, mesh_samples)
            if line.startswith("v "):
                try:
                    vertices.append([float(word) for word in line.split()[1:4]])
                except ValueError as error:
                    raise CloudError(f"{path}: damaged OBJ line '{line.strip()[:60]}'") from error
    if any(len(vertex) != 3 for vertex in vertices):
        raise CloudError(f"{path}: damaged OBJ file: a vertex needs three coordinates")
    return RawCloud(np.array(vertices, dtype=np.float64).reshape(-1, 3))


def _read_mesh(path: Path, samples: int) -> RawCloud:
    """Sample the visible surface of the mesh `path` evenly, the same points every time."""
    from nrdf.mesh import load_mesh, outer_skin

    try:
        vertices, faces = load_mesh(path)
        skin = outer_skin(vertices, faces, samples, np.random.default_rng(0))[1]
    except DataError as error:
        raise CloudError(str(error)) from error
    logger.info("%s is a mesh: sampled %d points of its surface", path, len(skin.points))
    return RawCloud(skin.points, skin.normals)
