"""Dense pseudo-correspondences between training shapes, by registering templates to all of them.

A few shapes serve as templates. Each is registered to every shape (`nrdf.shapes.registration`),
which puts its points on all of them: any two shapes then correspond through any template. They are
stored in the shape files as groups `template-00`, `template-01`, ..., with a weight that falls with
the distance left between the moved template and the shape.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from nrdf.errors import DataError
from nrdf.shapes.dataset import (
    Correspondence,
    Shape,
    read_shape,
    read_stamp,
    shape_paths,
    write_shape,
)
from nrdf.shapes.registration import RegistrationSettings, RegistrationTemplate
from nrdf.tasks import Workers, run_tasks

log = logging.getLogger(__name__)

TEMPLATE_POINTS = 1024
TARGET_POINTS = 2048
TRUST_SCALE = 0.05
"""Canonical distance at which the weight of a correspondence has fallen to 1/e."""
_CELLS = 20


@dataclass(frozen=True)
class CorrespondReport:
    """templates: names of the shapes that serve; done, skipped: how many shapes were registered
    now, and how many had been before."""

    templates: list[str]
    done: int
    skipped: int


def correspond_folders(
    folders: list[Path],
    templates: int = 12,
    workers: Workers = 1,
    settings: RegistrationSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
    templates_from: Path | None = None,
) -> CorrespondReport:
    """Add the groups `template-*` to every train and val shape of data folders (of one category).

    Templates are chosen out of the train shapes of all folders, or of `templates_from` alone; where
    there are fewer than asked for, all of them serve, with a warning.

    Shapes that have them already, from the same templates and settings, are kept: an interrupted
    run goes on. `progress` is told (done, all). A worker needs about 70 MB a template. Raises
    DataError without training shapes or templates, or for a shape file that cannot be read.
    """
    settings = settings or RegistrationSettings()
    train = [path for folder in folders for path in shape_paths(folder, "train")]
    eligible = train if templates_from is None else shape_paths(templates_from, "train")
    where = ", ".join(map(str, folders if templates_from is None else [templates_from]))
    if not eligible:
        raise DataError(f"no training shapes in {where or 'no folder'}: nothing to register")
    if templates < 1:
        raise DataError(f"{templates} templates are none; give 1 or more")
    if templates > len(eligible):
        have = f"{len(eligible)} training shapes in {where}"
        log.warning("%d templates were asked for; the %s all serve", templates, have)
    templates = min(templates, len(eligible))
    shapes = [read_shape(path) for path in eligible]
    chosen = choose_templates(shapes, templates)
    names = [shapes[index].name for index in chosen]
    key = hashlib.sha256(repr((names, settings)).encode()).hexdigest()[:12]
    paths = train + [path for folder in folders for path in shape_paths(folder, "val")]
    todo = [path for path in paths if not (read_stamp(path) or "").endswith(f"+{key}")]
    samples = [_oriented_sample(shapes[index], TEMPLATE_POINTS) for index in chosen]
    del shapes
    register = partial(_register_all, samples, settings, key)
    try:
        for count, (_, result) in enumerate(run_tasks(register, todo, workers), 1):
            if isinstance(result, Exception):
                raise result
            if progress is not None:
                progress(count, len(todo))
    finally:
        _templates.clear()
    return CorrespondReport(names, len(todo), len(paths) - len(todo))


def choose_templates(shapes: list[Shape], count: int) -> list[int]:
    """Indices of `count` different shapes that stand for all.

    Greedy (facility location): each next one brings all shapes nearest to a chosen one, in a
    coarse, blurred occupancy of their surfaces.
    """
    features = np.stack([_coarse(shape.surface_points) for shape in shapes])
    squared = (features**2).sum(1)
    product = features @ features.T
    distance = np.sqrt(np.maximum(squared[:, None] + squared[None] - 2 * product, 0))
    nearest = np.full(len(shapes), np.inf)
    chosen: list[int] = []
    for _ in range(count):
        cost = np.minimum(nearest, distance).sum(axis=1)
        cost[chosen] = np.inf
        chosen.append(int(cost.argmin()))
        nearest = np.minimum(nearest, distance[chosen[-1]])
    return chosen


def _coarse(points: np.ndarray) -> np.ndarray:
    cell = ((points + 0.5) * _CELLS).astype(int).clip(0, _CELLS - 1)
    counts = np.zeros((_CELLS,) * 3)
    np.add.at(counts, tuple(cell.T), 1)
    return np.sqrt(gaussian_filter(counts / len(points), 1.2)).ravel().astype(np.float32)


def _oriented_sample(shape: Shape, count: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(list(shape.name.encode()))
    chosen = rng.permutation(len(shape.surface_points))[:count]
    return shape.surface_points[chosen], shape.surface_normals[chosen]


_templates: dict[str, list[RegistrationTemplate]] = {}  # by key, made once in each process


def _register_all(
    samples: list[tuple[np.ndarray, np.ndarray]],
    settings: RegistrationSettings,
    key: str,
    path: Path,
) -> None:
    if key not in _templates:
        _templates[key] = [RegistrationTemplate(*sample, settings) for sample in samples]
    shape = read_shape(path)
    points, normals = _oriented_sample(shape, TARGET_POINTS)
    groups = {
        name: group
        for name, group in shape.correspondences.items()
        if not name.startswith("template-")
    }
    for number, template in enumerate(_templates[key]):
        found = template.register(points, normals)
        groups[f"template-{number:02d}"] = Correspondence(
            points=found.points,
            normals=normals[found.target_index],
            weight=np.exp(-((found.distance / TRUST_SCALE) ** 2)),
        )
    stamp = (read_stamp(path) or "").partition("+")[0]
    write_shape(path, replace(shape, correspondences=groups), f"{stamp}+{key}")
