"""The Benchmark for Surface Region Correspondence (BSRC), as its authors publish it.

A folder a category (`Chair`, `Car`, `plane`), in it a folder an object, in it the object's cloud
`obj_pcd.ply` and each region as a cloud of some of its points, `cropped_<roi>.ply`.
"""

from __future__ import annotations

import hashlib
import logging
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import CloudError, DataError, RegionError, unknown_name
from nrdf.geometry.normals import estimate_normals
from nrdf.io.cloud import PointCloud, read_cloud
from nrdf.regions.region import region_indices

log = logging.getLogger(__name__)

FOLDERS = {"chair": "Chair", "car": "Car", "plane": "plane"}
ROIS = {
    "chair": ("1", "2b", "2f", "3", "5b", "5r", "7b", "7r"),
    "car": ("1", "2", "3", "4b", "4r", "6b", "6r", "7"),
    "plane": ("1", "2", "3", "4", "5rt", "5rb", "6bt", "6bb"),
}
OPPOSITE_SIDES = {
    "chair": (("2b", "2f"),),
    "car": (),
    "plane": (("5rt", "5rb"), ("6bt", "6bb")),
}
"""Regions that are the two sides of one thin part: the backrest's back and front, each wing's top
and bottom. The other pairs (a chair's 5b and 5r, a car's 4b and 4r, ...) are left and right."""
LABELS = ("published", "corrected")
NUMBERS = range(1, 11)
"""Objects of each category in the whole benchmark."""
DEVELOPMENT = (1, 3, 5, 7, 9)
"""The half of them that this project develops on."""
CLOUD = "obj_pcd.ply"


@dataclass(frozen=True)
class Correction:
    """Two regions of an object whose labels are exchanged as published, and what shows it.

    evidence: the mean y (+Y is up) of the oriented normals of each, as labelled; elsewhere: the
    same of the regions of those names on the other objects at hand, lowest and highest.
    """

    category: str
    object: str
    rois: tuple[str, str]
    evidence: tuple[float, float]
    elsewhere: tuple[tuple[float, float], tuple[float, float]]


CORRECTIONS = (
    Correction("plane", "plane5", ("5rt", "5rb"), (-0.68, 0.93), ((0.87, 0.94), (-0.83, -0.50))),
    Correction("plane", "plane5", ("6bt", "6bb"), (-0.64, 0.93), ((0.86, 0.95), (-0.81, -0.53))),
)
"""Labels that are wrong as published: what plane5 calls the top of a wing points down."""


@dataclass(frozen=True, eq=False)
class BenchmarkObject:
    """An object of BSRC, in its file's coordinates; equal to others with the same checksum.

    cloud: with oriented normals; regions: each region's points (m, 3) as its file has them; truth:
    the same as indices (k,) of the cloud's points, ascending; checksum: of its name and files.
    """

    name: str
    cloud: PointCloud
    regions: dict[str, np.ndarray]
    truth: dict[str, np.ndarray]
    checksum: str

    def __eq__(self, other: object) -> bool:
        return isinstance(other, BenchmarkObject) and self.checksum == other.checksum

    def __hash__(self) -> int:
        return hash(self.checksum)

    def mean_up(self, roi: str) -> float:
        """Mean y of the oriented normals of a region: above 0 where it faces up."""
        assert self.cloud.normals is not None  # read_bsrc estimates them
        return float(self.cloud.normals[self.truth[roi], 1].mean())


@dataclass(frozen=True)
class Benchmark:
    """The objects of one category that are at hand, by number, and how their labels are read."""

    category: str
    labels: str
    objects: tuple[BenchmarkObject, ...]

    @property
    def rois(self) -> tuple[str, ...]:
        """The regions' names in the order of the paper's Table II."""
        return ROIS[self.category]

    @property
    def pairs(self) -> list[tuple[BenchmarkObject, BenchmarkObject]]:
        """Every ordered (reference, target) of two different objects, by reference."""
        return list(permutations(self.objects, 2))

    @property
    def numbers(self) -> list[int]:
        """The numbers in the objects' names."""
        return [_number(item.name, self.category) for item in self.objects]

    @property
    def missing(self) -> list[int]:
        """Numbers of the whole benchmark's objects that are not at hand."""
        return sorted(set(NUMBERS) - set(self.numbers))

    def describe(self) -> str:
        """Which objects, pairs and labels a table is of, in words."""
        half = " (the development half)" if tuple(self.numbers) == DEVELOPMENT else ""
        half = half if self.missing else " (the whole benchmark)"
        read = "labels as published" if self.labels == "published" else "labels corrected"
        absent = f"; not there: {_listed(self.missing)}" if self.missing else ""
        return (
            f"objects {_listed(self.numbers)} of {self.category}{half}, {len(self.pairs)} ordered "
            f"pairs, {read}{absent}"
        )


def read_bsrc(folder: Path, category: str, labels: str = "published") -> Benchmark:
    """The objects of a category under a BSRC folder; any subset of the ten will do.

    labels: "published", or "corrected" (with `CORRECTIONS` applied). Objects that are not there are
    named in the log. Raises DataError for a folder that is no BSRC folder, fewer than two objects,
    or, naming the file, one that is missing, cannot be read, has no points, or does not lie on its
    object.
    """
    if category not in FOLDERS:
        raise DataError(unknown_name("BSRC category", category, list(FOLDERS)))
    if labels not in LABELS:
        raise DataError(unknown_name("reading of the labels", labels, LABELS))
    root = _category_folder(Path(folder), category)
    places = {}
    for place in sorted(path for path in root.iterdir() if path.is_dir()):
        number = _number(place.name, category)
        if number:
            places[number] = place
        else:
            log.warning("%s is left out: no name such as %s1", place, category)
    if len(places) < 2:
        raise DataError(
            f"{root} holds {len(places)} objects; a pair needs at least two, in folders such as "
            f"{root / category}1"
        )
    objects = tuple(_read_object(places[number], category, labels) for number in sorted(places))
    benchmark = Benchmark(category, labels, objects)
    if benchmark.missing:
        missing = ", ".join(f"{category}{number}" for number in benchmark.missing)
        log.info("BSRC's %s are not in %s; going on with the others", missing, root)
    return benchmark


def _category_folder(folder: Path, category: str) -> Path:
    root = folder / FOLDERS[category]
    if root.is_dir():
        return root
    reason = "" if folder.is_dir() else f": there is no folder {folder}"
    known = ", ".join(FOLDERS.values())
    if folder.name in FOLDERS.values():
        reason = f": {folder} is a category's own folder, give the one above it"
    raise DataError(
        f"no BSRC objects in {root}{reason}; expected folders such as {root / category}1 (give the "
        f"folder that holds {known})"
    )


def _number(name: str, category: str) -> int:
    """The number in an object's name, 0 if it is no such name."""
    digits = name.removeprefix(category)
    return int(digits) if digits != name and digits.isdecimal() else 0


def _read_object(place: Path, category: str, labels: str) -> BenchmarkObject:
    swaps = _exchanged(category, place.name) if labels == "corrected" else {}
    files = {roi: place / f"cropped_{swaps.get(roi, roi)}.ply" for roi in ROIS[category]}
    for file in (place / CLOUD, *files.values()):
        if not file.is_file():
            raise DataError(
                f"the BSRC object {place.name} is not complete: no file {file}; expected {CLOUD} "
                f"and cropped_ROI.ply for the regions {', '.join(ROIS[category])}"
            )
    points = _read_points(place / CLOUD, place.name)
    cloud = PointCloud(points, estimate_normals(points))
    tree = cKDTree(points)
    regions, truth = {}, {}
    for roi, file in files.items():
        regions[roi] = _read_points(file, f"region {roi} of {place.name}")
        try:
            truth[roi] = np.unique(region_indices(regions[roi], cloud, lambda: tree))
        except RegionError as error:
            raise DataError(
                f"{file}: {error} Expected: some of the points of {place / CLOUD}"
            ) from None
    digest = hashlib.sha256(place.name.encode())
    for file in (place / CLOUD, *files.values()):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return BenchmarkObject(place.name, cloud, regions, truth, digest.hexdigest())


def _read_points(file: Path, what: str) -> np.ndarray:
    try:
        return read_cloud(file).points
    except CloudError as error:
        raise DataError(
            f"{error} (BSRC's {what}); expected at least one point: get the file again, or take "
            f"the folder {file.parent} away to go on without this object"
        ) from None


def _exchanged(category: str, name: str) -> dict[str, str]:
    """Region name to the one whose file holds it, for an object's corrections."""
    found: dict[str, str] = {}
    for correction in CORRECTIONS:
        if (correction.category, correction.object) == (category, name):
            first, second = correction.rois
            found |= {first: second, second: first}
    return found


def _listed(numbers: list[int]) -> str:
    return ", ".join(map(str, numbers))
