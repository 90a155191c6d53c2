"""Files of one kind of object, meshes and scans alike, as training shapes with +Y up."""

from __future__ import annotations

import hashlib
import logging
import zlib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from nrdf.errors import DataError, NrdfError
from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.normals import estimate_normals
from nrdf.geometry.sampling import downsample
from nrdf.geometry.similarity import up_axis, upright
from nrdf.geometry.winding import WindingNumber
from nrdf.io.cloud import PointCloud, check_cloud, read_cloud
from nrdf.io.formats.mesh_file import MESH_ENDINGS
from nrdf.scans.clean import clean_scan
from nrdf.shapes.dataset import Shape, read_shape, read_stamp, write_shape
from nrdf.shapes.occupancy import occupancy_queries
from nrdf.tasks import Workers, run_tasks

log = logging.getLogger(__name__)

ENDINGS = (*MESH_ENDINGS, ".pcd", ".xyz", ".npz", ".npy", ".csv")
"""Of the files that are looked at."""
MOST = 60
"""Objects of a folder that are used: more take longer and teach little more."""
FEWEST = 3
"""Objects that it takes: two to learn from, and one to judge by."""
SURFACE_POINTS = 8192
_SAMPLES = 30_000  # of a mesh, before they are thinned evenly
_QUERIES = 8192


@dataclass(frozen=True)
class ReadObjects:
    """shapes: of every file that can be used, by name; refused: file names and reasons; left: how
    many files were not looked at, as there are more than `MOST`; scans: names of the shapes that
    are scans, not meshes."""

    shapes: list[Shape]
    refused: Mapping[str, str]
    left: int
    scans: tuple[str, ...]


def find_files(folder: Path) -> list[Path]:
    """Meshes and clouds in `folder` and below, sorted.

    Raises DataError if there is no such folder, or fewer than `FEWEST` files in it.
    """
    if not folder.is_dir():
        raise DataError(f"no folder {folder}: give the folder with the meshes or scans")
    found = sorted(p for p in folder.rglob("*") if p.suffix.lower() in ENDINGS and p.is_file())
    if not found:
        raise DataError(f"{folder} holds no mesh and no scan; known: {', '.join(ENDINGS)}")
    if len(found) < FEWEST:
        raise DataError(too_few(len(found), f"in {folder}"))
    return found


def too_few(count: int, where: str) -> str:
    """What to say where there are fewer than `FEWEST` different objects."""
    objects = "1 object is" if count == 1 else f"{count} objects are"
    return (
        f"{objects} {where}, and it takes {FEWEST} different ones to learn what objects of a kind "
        "have in common: add some, or use --model registration, which needs none"
    )


def read_objects(
    files: Sequence[Path],
    folder: Path,
    category: str,
    up: str,
    out: Path,
    workers: Workers = 1,
    progress: Callable[[int, int], None] | None = None,
) -> ReadObjects:
    """Training shapes of `files` (which are in `folder`), turned so that +Y is up, not yet aligned.

    up: axis that points up in the files. Shapes are kept in the folder `out`: what is there is not
    made again. Of more than `MOST` files an even part is taken. Raises DataError if fewer than
    `FEWEST` can be used.
    """
    step = max(1.0, len(files) / MOST)
    chosen = [files[int(i * step)] for i in range(min(len(files), MOST))]
    named = {_name(path, folder): path for path in chosen}
    stamps = {name: _stamp(path, category, up) for name, path in named.items()}
    out.mkdir(parents=True, exist_ok=True)
    refused: dict[str, str] = {}
    todo = [(n, p) for n, p in named.items() if read_stamp(out / f"{n}.npz") != stamps[n]]
    work = partial(_write_one, category, up, out)
    for done, ((name, path), result) in enumerate(run_tasks(work, todo, workers), 1):
        if isinstance(result, Exception):
            text = str(result) if isinstance(result, NrdfError | OSError) else repr(result)
            refused[path.name] = text.removeprefix(f"{path}: ")
            named.pop(name)
        if progress is not None:
            progress(done, len(todo))
    if len(named) < FEWEST:
        for empty in (out, out.parent):  # nothing is left where nothing was made
            with suppress(OSError):
                empty.rmdir()
        why = "; ".join(f"{name}: {reason}" for name, reason in list(refused.items())[:3])
        where = f"left of {len(chosen)} files in {folder}" + f" ({why})" * bool(why)
        raise DataError(too_few(len(named), where))
    shapes = [read_shape(out / f"{name}.npz") for name in named]
    scans = tuple(shape.name for shape in shapes if shape.source == SCAN)
    return ReadObjects(shapes, refused, len(files) - len(chosen), scans)


MESH, SCAN = "mesh", "scan"
"""Sources of shapes, while they are read."""


def read_object(path: Path, name: str, category: str, up: str) -> Shape:
    """The training shape of one file, turned so that +Y is up, canonical.

    A mesh is sampled on its outer skin. A cloud is cleaned as a scan is, and its normals estimated
    where it has none. Raises CloudError for a file that cannot be used.
    """
    cloud = read_cloud(path, _SAMPLES)
    source = SCAN if cloud.mesh is None else MESH
    if source == SCAN:
        cloud = clean_scan(cloud, up_axis(up)).cloud
    check_cloud(cloud, MINIMUM_POINTS)
    kept = downsample(cloud.points, SURFACE_POINTS, np.random.default_rng(0))
    turn = upright(up_axis(up))
    points = cloud.points[kept] @ turn
    loc, scale = canonical_transform(points)
    points = (points - loc) / scale
    if cloud.normals is not None:
        normals = cloud.normals[kept] @ turn
    else:
        sensors = None if cloud.sensors is None else (cloud.sensors @ turn - loc) / scale
        normals = estimate_normals(points, sensors=sensors)
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    queries = occupancy_queries(points.astype(np.float32), _QUERIES, rng)
    inside = WindingNumber(points, normals)(queries.astype(np.float64), order=1) > 0.5
    return Shape(
        name=name,
        category=category,
        source=source,
        surface_points=points.astype(np.float32),
        surface_normals=normals.astype(np.float32),
        query_points=queries,
        query_occupancies=inside,
        loc=loc,
        scale=scale,
    )


def turned(shape: Shape, rotation: np.ndarray) -> Shape:
    """A shape seen in another frame: points p become p @ rotation (3, 3), canonical again.

    A rotation of determinant -1 gives its mirror image. The way back to the file is given up.
    """
    points = shape.surface_points @ rotation
    centre, size = canonical_transform(points)
    return replace(
        shape,
        surface_points=((points - centre) / size).astype(np.float32),
        surface_normals=(shape.surface_normals @ rotation).astype(np.float32),
        query_points=((shape.query_points.astype(np.float64) @ rotation - centre) / size).astype(
            np.float32
        ),
        loc=np.zeros(3),
        scale=1.0,
    )


def cloud_of(shape: Shape, with_normals: bool = True) -> PointCloud:
    """The surface of a shape as a cloud, its normals known or not."""
    normals = np.asarray(shape.surface_normals, np.float64) if with_normals else None
    return PointCloud(np.asarray(shape.surface_points, np.float64), normals)


def _name(path: Path, folder: Path) -> str:
    return "-".join(path.relative_to(folder).parts)


def _stamp(path: Path, category: str, up: str) -> str:
    content = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    return f"learn/1 {category} {up} {SURFACE_POINTS} {content}"


def _write_one(category: str, up: str, out: Path, task: tuple[str, Path]) -> None:
    name, path = task
    shape = read_object(path, name, category, up)
    write_shape(out / f"{name}.npz", shape, _stamp(path, category, up))
