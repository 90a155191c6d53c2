"""Pictures of what was learned: the objects in their common frame, and regions found on others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.cluster.vq import kmeans2

from nrdf.learn.objects import cloud_of
from nrdf.regions.model import Model
from nrdf.shapes.dataset import Shape
from nrdf.viz.picture import Panel, draw_regions

MOST_SHOWN = 6
_REGIONS = 6
_NORMALS = 0.25  # canonical length that one unit of normal difference counts for


def draw_objects(shapes: Sequence[Shape], path: Path, size: int = 280) -> None:
    """Write a picture of some shapes in their common frame, seen from the front and the right.

    Raises OutputError if the file cannot be written.
    """
    panels = [
        Panel(shape.name, np.asarray(shape.surface_points, float), shape.surface_normals)
        for shape in shapes[:MOST_SHOWN]
    ]
    draw_regions(panels, path, size)


def draw_held_out(
    models: Mapping[str, Model], reference: Shape, targets: Sequence[Shape], path: Path
) -> None:
    """Write a picture of a reference cut into regions, and of the same regions found on targets
    that no model has learned from, by each model.

    Raises OutputError if the file cannot be written.
    """
    taught = cloud_of(reference, with_normals=False)
    regions = some_regions(reference)
    panels = [Panel("taught", taught.points, reference.surface_normals, regions, reference.name)]
    for target in targets:
        cloud = cloud_of(target, with_normals=False)
        for name, model in models.items():
            found = model.set_reference(taught).retrieve_all(regions, cloud, check=False)
            indices = {region: match.indices for region, match in found.items()}
            panels.append(Panel(name, cloud.points, target.surface_normals, indices, target.name))
    draw_regions(panels, path)


def some_regions(shape: Shape) -> dict[str, np.ndarray]:
    """A shape's surface points cut into parts that are near each other and face one way: name to
    indices."""
    features = np.concatenate(
        [shape.surface_points, _NORMALS * np.asarray(shape.surface_normals)], axis=1
    )
    label = kmeans2(features.astype(float), _REGIONS, minit="++", seed=0)[1]
    return {f"region {n + 1}": np.flatnonzero(label == n) for n in range(_REGIONS)}
