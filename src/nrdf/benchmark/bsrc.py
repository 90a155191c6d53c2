"""The Benchmark for Surface Region Correspondence (BSRC), as its authors publish it.

A folder a category (`Chair`, `Car`, `plane`), in it a folder an object, in it the object's cloud
`obj_pcd.ply` and each region as a cloud of some of its points, `cropped_<roi>.ply`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np

from nrdf.cloud import PointCloud, read_cloud
from nrdf.errors import DataError, unknown_name
from nrdf.geometry import estimate_normals

FOLDERS = {"chair": "Chair", "car": "Car", "plane": "plane"}
ROIS = {
    "chair": ("1", "2b", "2f", "3", "5b", "5r", "7b", "7r"),
    "car": ("1", "2", "3", "4b", "4r", "6b", "6r", "7"),
    "plane": ("1", "2", "3", "4", "5rt", "5rb", "6bt", "6bb"),
}
SWAPPED = {("plane", "plane5"): {"5rt": "5rb", "5rb": "5rt", "6bt": "6bb", "6bb": "6bt"}}
"""Labels that are wrong as published: plane5's wing tops and bottoms are exchanged (the mean
oriented normal of its `5rt`, "top", points down, -0.53; on the nine others up, +0.7 to +0.9)."""


@dataclass(frozen=True)
class BenchmarkObject:
    """An object of BSRC: its cloud (with oriented normals) and its regions' points by name."""

    name: str
    cloud: PointCloud
    regions: dict[str, np.ndarray]


def read_bsrc(folder: Path, category: str, labels: str = "published") -> list[BenchmarkObject]:
    """All objects of a category under a BSRC folder, by name.

    labels: "published", or "corrected" (with `SWAPPED` put right). Raises DataError for a folder
    that is no BSRC folder, or an object that lacks a file, naming it; CloudError for a file that
    cannot be read.
    """
    if category not in FOLDERS:
        raise DataError(unknown_name("BSRC category", category, list(FOLDERS)))
    if labels not in ("published", "corrected"):
        raise DataError(unknown_name("reading of the labels", labels, ["published", "corrected"]))
    root = Path(folder) / FOLDERS[category]
    if not root.is_dir():
        raise DataError(
            f"no BSRC objects in {root}; expected folders such as {root / category}1 (give the "
            f"folder that holds {', '.join(FOLDERS.values())})"
        )
    objects = []
    for place in sorted(path for path in root.iterdir() if path.is_dir()):
        swaps = SWAPPED.get((category, place.name), {}) if labels == "corrected" else {}
        files = {roi: place / f"cropped_{swaps.get(roi, roi)}.ply" for roi in ROIS[category]}
        for file in (place / "obj_pcd.ply", *files.values()):
            if not file.is_file():
                raise DataError(f"the BSRC object {place.name} is not complete: no file {file}")
        regions = {roi: read_cloud(file).points for roi, file in files.items()}
        points = read_cloud(place / "obj_pcd.ply").points
        cloud = PointCloud(points, estimate_normals(points))
        objects.append(BenchmarkObject(place.name, cloud, regions))
    if len(objects) < 2:
        raise DataError(f"{root} holds {len(objects)} objects; a pair needs at least two")
    return objects


def ordered_pairs(
    objects: list[BenchmarkObject],
) -> list[tuple[BenchmarkObject, BenchmarkObject]]:
    """Every (reference, target) of two different objects."""
    return list(permutations(objects, 2))
