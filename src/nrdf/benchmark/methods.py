"""Every way of finding regions, behind one call: `method(reference, target) -> name to indices`.

Indices are those of target points. A method that moves the region's own points gives the target
point that each of them is snapped to, in their order, so a target point may occur several times and
counts as often in CD-L1; one that finds a mask gives every point of it once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from nrdf.benchmark.bsrc import BenchmarkObject
from nrdf.errors import ConfigError, unknown_name
from nrdf.geometry import bounding_box, canonical_transform
from nrdf.regions.association import NORMAL_WEIGHT, VOTERS, snap, voters
from nrdf.regions.model import Embedded, Model, Taught
from nrdf.regions.region import region_indices
from nrdf.shapes.registration import RegistrationTemplate

Found = dict[str, np.ndarray]
Method = Callable[[BenchmarkObject, BenchmarkObject], Found]

NAMES = (
    "nrdf",
    "nrdf-points",
    "copy",
    "box",
    "copy-normals",
    "box-normals",
    "registration",
)
DESCRIPTIONS = {
    "nrdf": "the field, region as a mask on the target (default)",
    "nrdf-points": "the field, C's points snapped to the target (paper, eq. 9)",
    "copy": "the reference's points, snapped",
    "box": "scaled to the target's bounding box, snapped",
    "copy-normals": "copy, snapped with oriented normals",
    "box-normals": "box, snapped with oriented normals",
    "registration": "smooth non-rigid registration with normals, region as a mask",
}
_TEMPLATE_POINTS = 2048


def get_method(name: str, model: Model | None = None) -> Method:
    """A method by its name; those of the field need its model. Raises ConfigError."""
    if name not in NAMES:
        raise ConfigError(unknown_name("method", name, NAMES))
    if name.startswith("nrdf"):
        if model is None:
            raise ConfigError(f"method '{name}' needs the weights of a model (--model)")
        return _FieldMethod(model, "points" if name == "nrdf-points" else "mask")
    if name == "registration":
        return _Registration()
    return _Copied(box=name.startswith("box"), normals=name.endswith("normals"))


class _FieldMethod:
    """The field, each object embedded once for all its pairs."""

    def __init__(self, model: Model, association: str) -> None:
        self.model, self.association = model, association
        self.taught: dict[str, Taught] = {}
        self.embedded: dict[str, Embedded] = {}

    def __call__(self, reference: BenchmarkObject, target: BenchmarkObject) -> Found:
        if reference.name not in self.taught:
            self.taught[reference.name] = self.model.set_reference(reference.cloud)
        if target.name not in self.embedded:
            self.embedded[target.name] = self.model.embed(target.cloud)
        matches = self.taught[reference.name].retrieve_all(
            reference.regions, self.embedded[target.name], self.association
        )
        if self.association == "mask":
            return {name: match.indices for name, match in matches.items()}
        tree = cKDTree(target.cloud.points)
        return {name: tree.query(match.points)[1] for name, match in matches.items()}


class _Copied:
    """Nothing learned, nothing moved but the bounding box."""

    def __init__(self, box: bool, normals: bool) -> None:
        self.box, self.weight = box, NORMAL_WEIGHT if normals else 0.0

    def __call__(self, reference: BenchmarkObject, target: BenchmarkObject) -> Found:
        points = reference.cloud.points
        if self.box:
            low, high = bounding_box(points)
            target_low, target_high = bounding_box(target.cloud.points)
            points = (points - low) / (high - low) * (target_high - target_low) + target_low
        regions, normals = _region_indices(reference), _normals(reference)
        asked = np.concatenate(list(regions.values()))
        index, _ = snap(
            points[asked], normals[asked], target.cloud.points, _normals(target), self.weight
        )
        ends = np.cumsum([len(indices) for indices in regions.values()])
        return dict(zip(regions, np.split(index, ends[:-1]), strict=True))


class _Registration:
    """Registration from every reference to every target, with the defaults of its module."""

    def __init__(self) -> None:
        # One at a time, because its kernels take hundreds of megabytes; pairs come by reference.
        self.template: tuple[str, np.ndarray, RegistrationTemplate] | None = None

    def __call__(self, reference: BenchmarkObject, target: BenchmarkObject) -> Found:
        if self.template is None or self.template[0] != reference.name:
            points, normals = _canonical(reference)
            chosen = np.random.default_rng(0).permutation(len(points))[:_TEMPLATE_POINTS]
            template = RegistrationTemplate(points[chosen], normals[chosen])
            self.template = (reference.name, chosen, template)
        _, chosen, template = self.template
        points, normals = _canonical(target)
        sample = np.random.default_rng(1).permutation(len(points))[: 2 * _TEMPLATE_POINTS]
        mapped = template.register(points[sample], normals[sample])
        asked, _ = voters(mapped.points, template.normals, points, normals, NORMAL_WEIGHT, VOTERS)
        found = {}
        for name, indices in _region_indices(reference).items():
            member = np.zeros(len(reference.cloud.points), bool)
            member[indices] = True
            found[name] = np.flatnonzero(member[chosen][asked].mean(axis=1) > 0.5)
        return found


def _region_indices(item: BenchmarkObject) -> Found:
    tree = cKDTree(item.cloud.points)
    return {
        name: region_indices(region, item.cloud, lambda: tree)
        for name, region in item.regions.items()
    }


def _canonical(item: BenchmarkObject) -> tuple[np.ndarray, np.ndarray]:
    centre, scale = canonical_transform(item.cloud.points)
    return (item.cloud.points - centre) / scale, _normals(item)


def _normals(item: BenchmarkObject) -> np.ndarray:
    assert item.cloud.normals is not None  # read_bsrc estimates them
    return item.cloud.normals
