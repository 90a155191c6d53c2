"""A picture of the surfaces that fields know, above them the clouds that they saw."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from nrdf.geometry.mesh import Mesh
from nrdf.io.cloud import PointCloud
from nrdf.shapes.dataset import read_shape
from nrdf.viz.picture import Panel, render_panels
from nrdf.viz.sheet import Sheet
from nrdf_benchmark.methods.registry import MethodSpec
from nrdf_benchmark.shape import Settings, level_set, model_of

COLUMNS = 6
_LABEL = 26  # pixels above each row


def draw_surfaces(
    paths: Sequence[Path],
    specs: Sequence[MethodSpec],
    settings: Settings,
    path: Path,
    size: int = 260,
) -> None:
    """Write a picture of at most `COLUMNS` shapes, spread over all `paths`: their clouds, and below
    them a row for each method with its surface of `settings.level`.

    size: width of a column in pixels. A field without a surface leaves its place empty. Raises
    OutputError if the file cannot be written, and what reading shapes and weights raises.
    """
    chosen = np.linspace(0, len(paths) - 1, min(COLUMNS, len(paths))).round().astype(int)
    shapes = [read_shape(paths[index]) for index in chosen]
    clouds = [PointCloud(shape.surface_points, shape.surface_normals) for shape in shapes]
    panels: list[Panel | None] = [Panel("", cloud.points, cloud.normals) for cloud in clouds]
    for spec in specs:
        model = model_of(spec)
        for cloud in clouds:
            surface = level_set(model, model.encode(cloud), settings)
            panels.append(None if surface is None else Panel.of_mesh("", Mesh(*surface)))
    drawn = iter(render_panels([panel for panel in panels if panel is not None], size)[0][0])
    images = [None if panel is None else next(drawn) for panel in panels]
    labels = ["given", *(f"{spec.name}, occupancy {settings.level:g}" for spec in specs)]
    tall = max(image.shape[0] for image in images if image is not None) + _LABEL
    width, height = size * len(shapes), tall * len(labels)
    sheet = Sheet(width, height)
    for number, image in enumerate(images):
        row, column = divmod(number, len(shapes))
        if image is not None:
            sheet.paste(image, column * size, row * tall + _LABEL)
    for row, label in enumerate(labels):
        sheet.write(label, 10, row * tall + 8, 17, bold=True, anchor="la")
    sheet.save(path)
