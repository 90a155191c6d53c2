"""Training shapes from meshes of any quality: outer skin, outward normals, occupancy queries."""

from __future__ import annotations

import csv
import hashlib
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from nrdf.errors import CloudError, DataError, NrdfError, OutputError
from nrdf.geometry.canonical import canonical_transform
from nrdf.geometry.mesh import outer_skin
from nrdf.geometry.winding import mesh_winding_numbers
from nrdf.io.formats.mesh_file import MESH_ENDINGS, load_mesh
from nrdf.shapes.dataset import (
    INDEX,
    SPLITS,
    IndexRow,
    Shape,
    add_to_index,
    make_data_folder,
    settings_stamp,
    write_shape,
)
from nrdf.shapes.occupancy import occupancy_queries
from nrdf.tasks import Workers, run_tasks

MIN_ENCLOSED = 0.5  # share of the skin that must have an inside behind it
_PROBE = 0.002  # canonical distance behind the skin at which the inside is looked for
_VALIDATION_EVERY = 20


@dataclass(frozen=True)
class PrepareSettings:
    """What a prepared shape holds: points on its surface, and occupancy queries."""

    surface_points: int = 8192
    queries: int = 16384
    seed: int = 0


@dataclass(frozen=True)
class Provenance:
    """Where a mesh comes from: the column values of the data folder's index."""

    source: str
    split: str
    licence: str


@dataclass
class PrepareReport:
    """What became of the meshes: names of the shapes made and kept, and reasons by file name."""

    made: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)

    @property
    def exit_code(self) -> int:
        """0 if every mesh is a shape now, else 1."""
        return 1 if self.failed else 0


def prepare_folder(
    meshes: Path,
    out: Path,
    category: str,
    index: Path | None = None,
    settings: PrepareSettings | None = None,
    workers: Workers = 1,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> PrepareReport:
    """Make a training shape of every mesh in the folder `meshes` and below, in the folder `out`.

    index: a table with the columns name (or shape), source, split and licence (or
    licence_as_stated), and perhaps category; `index.csv` beside the meshes unless given. Without
    one the source is the folder's name, the licence is unknown, and one shape in 20 is
    for validation. Shapes in `out` that were made of the same file with the same settings are
    kept, unless `overwrite`; the command can be stopped and given again. `progress` is told
    (done, all). A mesh that cannot be used is named in the report, with the reason.

    Raises DataError if `meshes` holds no mesh or the index is wrong, OutputError if `out` cannot
    be written.
    """
    settings = settings or PrepareSettings()
    paths = find_meshes(meshes)
    table = _read_provenance(meshes, index, category)
    make_data_folder(out)
    report = PrepareReport()
    named: dict[str, Path] = {}
    for path in paths:
        name = "-".join(path.relative_to(meshes).with_suffix("").parts)
        if name in named:
            report.failed[path.name] = f"another mesh has the name '{name}': {named[name].name}"
        else:
            named[name] = path
    todo = []
    for name, path in named.items():
        target = out / f"{name}.npz"
        if not overwrite and settings_stamp(target) == _stamp(path, category, settings):
            report.kept.append(name)
        else:
            todo.append((name, path, _provenance(table, path).source))
    try:
        work = partial(_write_one, out, category, settings)
        for done, ((name, path, _), result) in enumerate(run_tasks(work, todo, workers), 1):
            if isinstance(result, OutputError):
                raise result  # nothing can be written: no other shape would fare better
            if isinstance(result, Exception):
                report.failed[path.name] = _reason(result, path)
            else:
                report.made.append(name)
            if progress is not None:
                progress(done, len(todo))
    finally:
        rows = [(name, _provenance(table, named[name])) for name in report.made + report.kept]
        add_to_index(
            out, [IndexRow(n, p.source, p.split, p.licence) for n, p in rows], remove=named
        )
    return report


def find_meshes(folder: Path) -> list[Path]:
    """Mesh files in `folder` and below, sorted. Raises DataError if there are none."""
    if not folder.is_dir():
        raise DataError(f"no folder {folder}")
    found = sorted(p for p in folder.rglob("*") if p.suffix.lower() in MESH_ENDINGS and p.is_file())
    if not found:
        raise DataError(f"{folder} holds no mesh; known formats: {', '.join(MESH_ENDINGS)}")
    return found


def prepare_mesh(path: Path, category: str, settings: PrepareSettings, source: str = "") -> Shape:
    """Training shape of the mesh file `path`.

    Raises DataError if the mesh is unreadable or empty, or encloses no volume.
    """
    vertices, faces = load_mesh(path)
    try:
        loc, scale = canonical_transform(vertices)
    except CloudError as error:
        raise DataError(f"no extent: {error}") from error
    vertices = (vertices - loc) / scale
    rng = np.random.default_rng([settings.seed, zlib.crc32(path.stem.encode())])
    faces, skin = outer_skin(vertices, faces, settings.surface_points, rng)
    queries = occupancy_queries(skin.points, settings.queries, rng)
    probes = (skin.points - _PROBE * skin.normals)[:1024]
    places = np.concatenate([probes, queries.astype("f8")])
    winding = mesh_winding_numbers(vertices, faces, places)
    # Close behind a sheet without thickness it is about one half.
    enclosed = float((winding[: len(probes)] > 0.6).mean())
    if enclosed < MIN_ENCLOSED:
        raise DataError(
            f"no volume: there is an inside behind only {enclosed:.0%} of its visible surface, at "
            f"least {MIN_ENCLOSED:.0%} is needed; close the mesh or give its sheets a thickness"
        )
    return Shape(
        name=path.stem,
        category=category,
        source=source,
        surface_points=skin.points.astype(np.float32),
        surface_normals=skin.normals.astype(np.float32),
        query_points=queries,
        query_occupancies=winding[len(probes) :] > 0.5,
        loc=loc,
        scale=scale,
    )


def _write_one(
    out: Path, category: str, settings: PrepareSettings, task: tuple[str, Path, str]
) -> None:
    name, path, source = task
    shape = prepare_mesh(path, category, settings, source)
    write_shape(out / f"{name}.npz", shape, _stamp(path, category, settings))


def _stamp(path: Path, category: str, settings: PrepareSettings) -> str:
    try:
        content = hashlib.sha256(path.read_bytes()).hexdigest()[:16]
    except OSError:
        content = "unreadable"
    return (
        f"mesh/1 {category} {settings.surface_points} {settings.queries} {settings.seed} {content}"
    )


def _reason(error: Exception, path: Path) -> str:
    text = str(error) if isinstance(error, NrdfError | OSError | RuntimeError) else repr(error)
    return text.removeprefix(f"{path}: ")


def _read_provenance(meshes: Path, index: Path | None, category: str) -> dict[str, Provenance]:
    """Provenance by mesh name; "" stands for the meshes that the table does not name."""
    table = {"": Provenance(meshes.resolve().name, "", "unknown")}
    if index is None:
        index = meshes / INDEX
        if not index.is_file():
            return table
    try:
        with open(index, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot read {index} ({error})") from error
    for row in rows:
        name = row.get("name") or row.get("shape")
        split = row.get("split") or ""
        if not name or split not in (*SPLITS, ""):
            raise DataError(
                f"{index}: each line needs a name (or shape) and a split of {', '.join(SPLITS)}; "
                f"not '{name or ''}', '{split}'"
            )
        if (row.get("category") or category).lower() != category.lower():
            continue
        licence = row.get("licence") or row.get("licence_as_stated") or "unknown"
        table[name] = Provenance(row.get("source") or table[""].source, split, licence)
    return table


def _provenance(table: dict[str, Provenance], path: Path) -> Provenance:
    found = table.get(path.stem, table[""])
    if found.split:
        return found
    validation = zlib.crc32(path.stem.encode()) % _VALIDATION_EVERY == 0
    return Provenance(found.source, "val" if validation else "train", found.licence)
