"""Files of training shapes: one uncompressed `.npz` a shape, and an `index.csv` beside them.

Keys of a file: ``pointcloud/points`` (n, 3) float32, ``pointcloud/normals`` (n, 3) float32,
``points/points`` (q, 3) float16 or float32, ``points/occupancies`` uint8 (bits packed by
`numpy.packbits`), ``loc`` (3,), ``scale`` (), ``category``, ``source``, and for each group of
correspondences ``correspondence/<group>/points``, ``/normals`` (m, 3) float32 and ``/weight`` (m,)
float16. Points are canonical: ``canonical = (original - loc) / scale``.

The two-file folders of Occupancy Networks (Mescheder et al., CVPR 2019) are read as they are.
"""

from __future__ import annotations

import csv
import io
import time
import zipfile
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nrdf.errors import DataError, OutputError
from nrdf.io.atomic import write_atomically
from nrdf.shapes.occupancy import pack_occupancies, unpack_occupancies

INDEX = "index.csv"
SPLITS = ("train", "val", "test")
_COLUMNS = ("name", "source", "split", "licence")


@dataclass(frozen=True)
class Correspondence:
    """Places of one shape; index i corresponds to index i of the same group on another shape.

    points: (m, 3), normals: (m, 3), weight: (m,) in [0, 1]; weight 0 means no counterpart here.
    """

    points: np.ndarray
    normals: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Shape:
    """One training shape in canonical coordinates.

    surface_points, surface_normals: (n, 3) float32, normals unit and outward; query_points: (q, 3)
    float32 or float16; query_occupancies: (q,) bool, True inside; loc (3,) and scale lead back:
    ``original = canonical * scale + loc``.
    """

    name: str
    category: str
    source: str
    surface_points: np.ndarray
    surface_normals: np.ndarray
    query_points: np.ndarray
    query_occupancies: np.ndarray
    correspondences: dict[str, Correspondence] = field(default_factory=dict)
    loc: np.ndarray = field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0


def write_shape(path: str | Path, shape: Shape, stamp: str = "") -> None:
    """Write `shape` to the file `path`, all of it or nothing.

    `stamp` says by which settings the shape was made (`read_stamp`). Raises DataError if an array
    has the wrong shape, OutputError if the file cannot be written.
    """
    arrays = {
        "pointcloud/points": np.asarray(shape.surface_points, np.float32),
        "pointcloud/normals": np.asarray(shape.surface_normals, np.float32),
        "points/points": np.asarray(shape.query_points),
        "points/occupancies": pack_occupancies(shape.query_occupancies),
        "loc": np.asarray(shape.loc, np.float64),
        "scale": np.asarray(shape.scale, np.float64),
        "category": np.asarray(shape.category),
        "source": np.asarray(shape.source),
        "stamp": np.asarray(stamp),
    }
    if arrays["points/points"].dtype != np.float16:
        arrays["points/points"] = arrays["points/points"].astype(np.float32)
    for name, group in shape.correspondences.items():
        if not name or "/" in name:
            raise DataError(f"'{name}' is no name for a group of correspondences")
        arrays[f"correspondence/{name}/points"] = np.asarray(group.points, np.float32)
        arrays[f"correspondence/{name}/normals"] = np.asarray(group.normals, np.float32)
        arrays[f"correspondence/{name}/weight"] = np.asarray(group.weight, np.float16)
    _check(str(path), arrays, len(shape.query_occupancies))
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]
    write_atomically(Path(path), [buffer.getbuffer()])


def read_shape(path: str | Path) -> Shape:
    """Shape of the file `path`, or of the Occupancy Networks folder `path`.

    Such a folder holds `pointcloud.npz` and `points.npz` or `bbx_points.npz`; its shape is named
    after the folder. Raises DataError if something is missing, damaged or of the wrong shape.
    """
    path = Path(path)
    if path.is_dir():
        return _read_folder(path)
    arrays = _load(path)
    needed = ("pointcloud/points", "pointcloud/normals", "points/points", "points/occupancies")
    _require(path, arrays, needed)
    occupancies = unpack_occupancies(
        path, arrays["points/occupancies"], len(arrays["points/points"])
    )
    _check(str(path), arrays, len(occupancies))
    groups = sorted({key.split("/")[1] for key in arrays if key.startswith("correspondence/")})
    for group in groups:
        keys = [f"correspondence/{group}/{part}" for part in ("points", "normals", "weight")]
        _require(path, arrays, keys)
    return Shape(
        name=path.stem,
        category=str(arrays.get("category", "")),
        source=str(arrays.get("source", "")),
        surface_points=arrays["pointcloud/points"],
        surface_normals=arrays["pointcloud/normals"],
        query_points=arrays["points/points"],
        query_occupancies=occupancies,
        correspondences={
            group: Correspondence(
                arrays[f"correspondence/{group}/points"],
                arrays[f"correspondence/{group}/normals"],
                arrays[f"correspondence/{group}/weight"],
            )
            for group in groups
        },
        loc=np.asarray(arrays.get("loc", np.zeros(3)), np.float64),
        scale=float(arrays.get("scale", 1.0)),
    )


def read_stamp(path: str | Path) -> str | None:
    """Stamp of a complete shape file, or None if there is no such file or it is damaged."""
    try:
        with zipfile.ZipFile(path) as archive:
            with archive.open("stamp.npy") as member:
                stamp = str(np.lib.format.read_array(member, allow_pickle=False))
            # The directory of a zip is its end, so a file that opens is complete.
            return stamp if "points/occupancies.npy" in archive.namelist() else None
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return None


def settings_stamp(path: str | Path) -> str | None:
    """The stamp up to the first "+": how the shape was made. Later steps add the rest."""
    stamp = read_stamp(path)
    return None if stamp is None else stamp.partition("+")[0]


def _read_folder(path: Path) -> Shape:
    cloud = _load(path / "pointcloud.npz")
    _require(path / "pointcloud.npz", cloud, ("points", "normals"))
    names = ("points.npz", "bbx_points.npz")
    query_file = next((path / name for name in names if (path / name).is_file()), path / names[0])
    queries = _load(query_file)
    _require(query_file, queries, ("points", "occupancies"))
    occupancies = unpack_occupancies(query_file, queries["occupancies"], len(queries["points"]))
    loc = np.asarray(cloud.get("loc", np.zeros(3)), np.float64)
    scale = float(cloud.get("scale", 1.0))
    shape = Shape(
        name=path.name,
        category=path.parent.name,
        source="occupancy-networks",
        surface_points=cloud["points"].astype(np.float32),
        surface_normals=cloud["normals"].astype(np.float32),
        query_points=queries["points"],
        query_occupancies=occupancies,
        loc=loc,
        scale=scale,
    )
    parts = {"pointcloud/points": shape.surface_points, "pointcloud/normals": shape.surface_normals}
    _check(str(path), {**parts, "points/points": shape.query_points}, len(occupancies))
    return shape


def _load(path: Path) -> dict[str, np.ndarray]:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return {key: arrays[key] for key in arrays.files}
    except FileNotFoundError as error:
        raise DataError(f"no shape file {path}") from error
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        raise DataError(f"{path}: truncated, altered or no shape file ({error})") from error


def _require(path: Path, arrays: dict[str, np.ndarray], keys: list[str] | tuple[str, ...]) -> None:
    missing = [key for key in keys if key not in arrays]
    if missing:
        raise DataError(
            f"{path}: no array {', '.join(missing)}; it has: {', '.join(arrays) or '(none)'}"
        )


def _check(path: str, arrays: dict[str, np.ndarray], queries: int) -> None:
    lengths = {"pointcloud": len(arrays["pointcloud/points"]), "points": queries}
    for key, array in arrays.items():
        owner, _, part = key.rpartition("/")
        if part not in ("points", "normals", "weight") or not owner:
            continue
        length = lengths.setdefault(owner, len(array))
        expected = (length,) if part == "weight" else (length, 3)
        if array.shape != expected or array.dtype.kind != "f":
            raise DataError(f"{path}: {key} is {array.shape} of {array.dtype}, expected {expected}")
        if not np.isfinite(array).all():
            raise DataError(f"{path}: {key} holds NaN or infinite values")


@dataclass(frozen=True)
class IndexRow:
    """One line of a data folder's `index.csv`."""

    name: str
    source: str
    split: str
    licence: str


def read_index(folder: str | Path) -> list[IndexRow]:
    """Lines of the `index.csv` of a data folder, in its order.

    Raises DataError if the file is missing, lacks a column, names a shape twice, or a split is
    none of train, val, test.
    """
    path = Path(folder) / INDEX
    try:
        with open(path, newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [c for c in _COLUMNS if c not in (reader.fieldnames or [])]
            if missing:
                raise DataError(f"{path}: no column {', '.join(missing)}")
            rows = [IndexRow(*(line[c] or "" for c in _COLUMNS)) for line in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(
            f"cannot read {path} ({error}); make a data folder by "
            "'nrdf model prepare' or 'nrdf model synth'"
        ) from error
    wrong = [row for row in rows if row.split not in SPLITS]
    if wrong:
        raise DataError(
            f"{path}: '{wrong[0].name}' has the split '{wrong[0].split}'; "
            f"known: {', '.join(SPLITS)}"
        )
    if len({row.name for row in rows}) < len(rows):
        raise DataError(f"{path}: a shape is named twice")
    return rows


def write_index(folder: str | Path, rows: list[IndexRow]) -> None:
    """Write `rows`, sorted by name, as the `index.csv` of a data folder, all of it or nothing."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for row in sorted(rows, key=lambda r: r.name):
        writer.writerow([row.name, row.source, row.split, row.licence])
    write_atomically(Path(folder) / INDEX, [text.getvalue().encode("utf-8")])


def add_to_index(folder: str | Path, rows: list[IndexRow], remove: Collection[str] = ()) -> None:
    """Put `rows` into the index of a data folder; the rows of other names that it has are kept.

    Names in `remove` that are not in `rows` are taken out.
    """
    folder = Path(folder)
    gone = {row.name for row in rows}.union(remove)
    others = read_index(folder) if (folder / INDEX).is_file() else []
    rows = [row for row in others if row.name not in gone] + rows
    if rows or others:
        write_index(folder, rows)


def make_data_folder(folder: str | Path) -> None:
    """Make a data folder where there is none, and tidy up what a killed run left half-written.

    Raises OutputError if it cannot be made, or holds something else than training shapes.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        entries = list(folder.iterdir())
        for entry in entries:
            stale = entry.suffix == ".part" and time.time() - entry.stat().st_mtime > 60.0
            if entry.name.startswith(".") and stale:
                entry.unlink()
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror or error}") from error
    visible = [e for e in entries if not e.name.startswith(".")]
    foreign = [e for e in visible if e.suffix != ".npz" and e.name != INDEX]
    if foreign:
        raise OutputError(
            f"{folder} is no data folder: it holds {foreign[0].name}; give a new or empty folder"
        )


def shape_paths(folder: str | Path, split: str | None = None) -> list[Path]:
    """Paths of the shapes that the index of a data folder lists, all or those of one `split`."""
    rows = read_index(folder)
    return [Path(folder) / f"{row.name}.npz" for row in rows if split in (None, row.split)]
