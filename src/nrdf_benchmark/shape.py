"""Table I: how well a field knows the shapes themselves, on shapes that it was not trained on."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import igl
import numpy as np
import torch

import nrdf
from nrdf.errors import ConfigError, DataError, OutputError, unknown_name
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.io.atomic import write_atomically
from nrdf.io.cloud import PointCloud
from nrdf.io.file_names import spreadsheet_text
from nrdf.regions.model import Model
from nrdf.shapes.dataset import Shape, read_shape, shape_paths
from nrdf.tasks import TaskLost, Workers, run_tasks
from nrdf_benchmark.methods.registry import METHODS, MethodSpec
from nrdf_benchmark.metrics import METRICS, MISSED, chamfer_l1

EDGE = 0.55
"""The grid reaches this far from the centre along each axis; the shape 0.5."""
PUBLISHED = {
    "chair": {"NDF": (0.083, 0.051), "IMDC": (0.062, 0.041), "NRDF": (0.054, 0.040)},
    "car": {"NDF": (0.065, 0.015), "IMDC": (0.060, 0.010), "NRDF": (0.058, 0.008)},
    "plane": {"NDF": (0.070, 0.012), "IMDC": (0.036, 0.006), "NRDF": (0.030, 0.004)},
}
"""Category to method to CD-L1 and MSE in the paper's Table I."""
_CHUNK = 8192  # queries at a time


@dataclass(frozen=True)
class Settings:
    """level: occupancy of the surface, the paper's unless given; resolution: nodes of the grid
    along each axis; points: drawn on the surface and taken of the cloud, at most all of it."""

    level: float = 0.75
    resolution: int = 64
    points: int = 8192

    def __post_init__(self) -> None:
        if not 0 < self.level < 1 or self.resolution < 2 or self.points < 2:
            raise ConfigError(
                f"level {self.level:g}, resolution {self.resolution}, points {self.points}: the "
                "level must lie between 0 and 1, resolution and points be at least 2"
            )


@dataclass(frozen=True)
class ShapeScore:
    """One shape.

    cd_l1: in canonical lengths, `MISSED` where the level set is empty; mse: of occupancy in [0, 1]
    over the shape's queries; sampling: CD-L1 of one half of the cloud from the other.
    """

    name: str
    cd_l1: float
    mse: float
    is_empty: bool
    sampling: float


@dataclass(frozen=True)
class ShapeResult:
    """One method on all shapes, in the order of their folder's index."""

    spec: MethodSpec
    shapes: tuple[ShapeScore, ...]

    @property
    def cd_l1(self) -> float:
        """Mean CD-L1 (the paper's convention)."""
        return float(np.mean([shape.cd_l1 for shape in self.shapes]))

    @property
    def mse(self) -> float:
        """Mean of the shapes' mean squared errors."""
        return float(np.mean([shape.mse for shape in self.shapes]))

    @property
    def empty(self) -> list[str]:
        """Names of the shapes whose level set is empty."""
        return [shape.name for shape in self.shapes if shape.is_empty]


def level_set(
    model: Model, encoded: EncodedCloud, settings: Settings
) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices (v, 3) in the cloud's frame and faces (f, 3) of the field's surface.

    Marching cubes over a grid of [-0.55, 0.55]³, on the logits, which are nearer to linear than
    occupancies are. None where the field is nowhere above or nowhere below the level.
    """
    count = settings.resolution
    axis = np.linspace(-EDGE, EDGE, count)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")  # x runs fastest, as igl wants it
    nodes = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    value = logits(model, encoded, nodes)
    level = float(np.log(settings.level / (1 - settings.level)))
    vertices, faces, _ = igl.marching_cubes(value, nodes, count, count, count, level)
    return (encoded.original(vertices), faces) if len(faces) else None


def logits(model: Model, encoded: EncodedCloud, points_canonical: np.ndarray) -> np.ndarray:
    """The occupancy's logits (m,) at canonical points (m, 3) of an encoded cloud."""
    parts = []
    with torch.inference_mode():
        for start in range(0, len(points_canonical), _CHUNK):
            queries = torch.as_tensor(
                points_canonical[start : start + _CHUNK], dtype=torch.float32, device=model.device
            )
            parts.append(model.field.occupancy(encoded.z, queries[None])[0].double().cpu().numpy())
    return np.concatenate(parts)


def score_shape(model: Model, shape: Shape, settings: Settings) -> ShapeScore:
    """CD-L1 of the level set from the input cloud, and the error of occupancy.

    The field sees the cloud as in use (`Model.embed`). As many points are drawn evenly on the
    level set as are taken of the cloud, the same ones every time.
    """
    import trimesh

    rng = np.random.default_rng(0)
    cloud = shape.surface_points.astype(float)
    cloud = cloud[rng.permutation(len(cloud))[: settings.points]]
    sampling = chamfer_l1(cloud[::2], cloud[1::2])
    encoded = model.encode(PointCloud(shape.surface_points, shape.surface_normals))
    queries = encoded.canonical(shape.query_points.astype(float))
    guess = 1 / (1 + np.exp(-np.clip(logits(model, encoded, queries), -50, 50)))
    mse = float(np.mean((guess - shape.query_occupancies) ** 2))
    surface = level_set(model, encoded, settings)
    if surface is None:
        return ShapeScore(shape.name, MISSED, mse, True, sampling)
    mesh = trimesh.Trimesh(*surface, process=False)
    points, _ = trimesh.sample.sample_surface(mesh, len(cloud), seed=0)
    return ShapeScore(shape.name, chamfer_l1(np.asarray(points), cloud), mse, False, sampling)


def find_shapes(folder: Path, split: str = "test") -> tuple[str, list[Path]]:
    """Category and paths of a data folder's shapes of one split.

    Raises DataError where there are none, saying how to get some, and as `read_shape` does.
    """
    paths = shape_paths(folder, split)
    if not paths:
        raise DataError(
            f"{folder} has no shapes of the split '{split}'; prepare some (nrdf model prepare "
            "MESHES --category CATEGORY --index INDEX, the index a table whose column split "
            f"says {split}), or score those of another split with --split"
        )
    return read_shape(paths[0]).category, paths


def check_methods(names: Sequence[str]) -> None:
    """ConfigError for a method that is not known, or has no occupancy."""
    known = [name for name, entry in METHODS.items() if entry.is_learned]
    for name in names:
        if name not in known:
            raise ConfigError(unknown_name("method with an occupancy field", name, known))


@dataclass(frozen=True)
class _Task:
    spec: MethodSpec
    path: Path
    category: str
    settings: Settings


def evaluate_shapes(
    category: str,
    paths: Sequence[Path],
    specs: Sequence[MethodSpec],
    settings: Settings,
    workers: Workers = 1,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[ShapeResult]:
    """Score methods on shapes, on `workers` processes of one thread each.

    With one worker everything runs in this process. `progress` is told (method, shapes done, all).
    Raises DataError for a shape that cannot be read or is of another category, or a process that
    dies, ModelError for weights that cannot be used.
    """
    tasks = [_Task(spec, path, category, settings) for spec in specs for path in paths]
    done: dict[tuple[str, Path], ShapeScore] = {}
    counts = dict.fromkeys((spec.name for spec in specs), 0)
    with closing(run_tasks(_run, tasks, workers)) as results:
        for task, result in results:
            if isinstance(result, Exception):
                raise _explained(task, result)
            done[task.spec.name, task.path] = result
            counts[task.spec.name] += 1
            if progress is not None:
                progress(task.spec.name, counts[task.spec.name], len(paths))
    return [ShapeResult(spec, tuple(done[spec.name, path] for path in paths)) for spec in specs]


def _run(task: _Task) -> ShapeScore:
    shape = read_shape(task.path)
    if shape.category != task.category:
        raise DataError(
            f"{task.path} is of category {shape.category}, others are of {task.category}; give a "
            "folder of one category"
        )
    return score_shape(model_of(task.spec), shape, task.settings)


@lru_cache(maxsize=1)
def model_of(spec: MethodSpec) -> Model:
    """The model of a learned method; the last one is kept. Raises as reading weights does."""
    assert spec.weights is not None  # check_methods lets no others pass
    return nrdf.load_model(spec.weights, spec.device)


def _explained(task: _Task, error: Exception) -> Exception:
    if not isinstance(error, TaskLost):
        return error
    return DataError(f"{task.spec.name}, {task.path.stem}: {error}; give fewer --workers")


def table(results: Sequence[ShapeResult], category: str, settings: Settings) -> str:
    """Markdown: a row a method, the published ones below, and how the metrics are computed."""
    shapes = results[0].shapes
    lines = [
        f"| {category}, {len(shapes)} shapes | CD-L1 | MSE | empty |",
        "|---|---|---|---|",
    ]
    for result in results:
        name = result.spec.name
        empty = len(result.empty)
        lines.append(f"| `{name}` | **{result.cd_l1:.4f}** | **{result.mse:.4f}** | {empty} |")
    for name, (distance, mse) in PUBLISHED.get(category, {}).items():
        lines.append(f"| *published* {name} | {distance} | {mse} | |")
    sampling = float(np.mean([shape.sampling for shape in shapes]))
    lines += [
        "",
        f"CD-L1 between the field's surface of occupancy {settings.level:g} and the input cloud, "
        f"{settings.points} points of each: {METRICS['cd-l1'].formula}. One half of the clouds is "
        f"{sampling:.4f} from the other. Grid of {settings.resolution}³ nodes; a field that is "
        f"nowhere above the level (empty) counts as {MISSED:g}. MSE: of occupancy in [0, 1] over "
        "the shapes' stored queries. Lower is better.",
    ]
    for result in results:
        if result.empty:
            lines += ["", f"Empty with `{result.spec.name}`: {', '.join(result.empty)}."]
    return "\n".join(lines)


def write_results(
    results: Sequence[ShapeResult],
    category: str,
    settings: Settings,
    folder: Path,
    provenance: Mapping[str, Any],
) -> list[Path]:
    """Write `table1-<category>` as .md, .csv and .json into `folder`; their paths.

    Raises OutputError.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["category", "method", "shape", "cd_l1", "mse", "empty"])
    for result in results:
        for shape in result.shapes:
            metrics = f"{shape.cd_l1:.9g}", f"{shape.mse:.9g}", int(shape.is_empty)
            names = category, result.spec.name, shape.name
            writer.writerow([*map(spreadsheet_text, names), *metrics])
    content = {
        **provenance,
        "category": category,
        "settings": {**asdict(settings), "grid_edge": EDGE, "empty": MISSED},
        "convention": METRICS["cd-l1"].formula,
        "published": PUBLISHED.get(category, {}),
        "methods": {
            result.spec.name: {
                "cd_l1": result.cd_l1,
                "mse": result.mse,
                "empty": result.empty,
                "weights_sha256": result.spec.sha256,
                "shapes": [asdict(shape) for shape in result.shapes],
            }
            for result in results
        },
    }
    texts = {
        "md": table(results, category, settings) + "\n",
        "csv": text.getvalue(),
        "json": json.dumps(content, indent=1, ensure_ascii=False) + "\n",
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot make {folder}: {error.strerror}; choose another --out") from None
    paths = [folder / f"table1-{category}.{ending}" for ending in texts]
    for path, part in zip(paths, texts.values(), strict=True):
        write_atomically(path, [part.encode("utf-8")])
    return paths
