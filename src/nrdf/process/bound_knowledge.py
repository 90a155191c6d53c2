"""Process knowledge with its reference cloud loaded and its regions found on it."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from nrdf.errors import CloudError, NrdfError, ProcessError
from nrdf.field.cloud_encoder import MINIMUM_POINTS
from nrdf.geometry.units import METRES, USUAL_SIZES, guess_unit
from nrdf.io.cloud import PointCloud, check_cloud, in_metres, read_cloud
from nrdf.io.files import open_file, sha256_of
from nrdf.io.model_file import listed
from nrdf.process.knowledge import Knowledge, Reference, Region
from nrdf.process.knowledge_file import read_knowledge
from nrdf.regions.files import read_region_file
from nrdf.regions.region import whole_region

log = logging.getLogger(__name__)

_COMMON = 0.02  # share of points that two regions may share: borders are drawn by hand
_ODD_SIZE = 3.0  # factor off the usual size from which there is a warning about the unit


@dataclass(frozen=True)
class BoundKnowledge:
    """Knowledge with its reference cloud and regions.

    cloud: the reference in metres. regions: name to indices (k,) of its points, in the order of
    the knowledge's regions.
    """

    knowledge: Knowledge
    cloud: PointCloud
    regions: dict[str, np.ndarray]


def read_bound_knowledge(path: str | Path) -> BoundKnowledge:
    """A knowledge file with its reference and regions.

    Raises ProcessError as `read_knowledge` and `resolve` do, and CloudError for a reference that
    cannot be read.
    """
    path = Path(path)
    return resolve(read_knowledge(path), path.parent, str(path))


def resolve(
    knowledge: Knowledge, folder: str | Path = ".", origin: str = "knowledge"
) -> BoundKnowledge:
    """Load the reference of a knowledge and find its regions there.

    File names are relative to `folder`; `origin` names the knowledge in messages.

    Raises ProcessError for a checksum that does not match, an unknown or contradictory unit, and,
    all in one message, for regions that are not on the reference or overlap without
    `allow_overlap`. Raises CloudError for a reference that cannot be read or used.
    """
    folder = Path(folder)
    cloud, unit = _reference(knowledge.reference, knowledge.category, folder, origin)
    regions: dict[str, np.ndarray] = {}
    faults = []
    for region in knowledge.regions:
        try:
            given = _given(region, folder, unit)
            regions[region.name] = whole_region(given, cloud)
        except NrdfError as error:
            faults.append(f"region '{region.name}': {error}")
    faults += [] if knowledge.allow_overlap else overlaps(regions)
    if faults:
        raise ProcessError(listed(origin, faults))
    return BoundKnowledge(knowledge, cloud, regions)


def overlaps(regions: dict[str, np.ndarray]) -> list[str]:
    """A message for each pair of regions, indices (k,), that share more than some border points."""
    lines = []
    for (one, first), (other, second) in combinations(regions.items(), 2):
        common = len(np.intersect1d(first, second, assume_unique=True))
        if common > _COMMON * min(len(first), len(second)):
            lines.append(
                f"regions '{one}' and '{other}' overlap: they share {common} of their {len(first)} "
                f"and {len(second)} points, which would be worked twice; take them out of one, or "
                "set allow_overlap: true"
            )
    return lines


def known_unit(cloud: PointCloud, unit: str | None, category: str, what: str, option: str) -> str:
    """As `unit_and_warnings`; logs the warnings."""
    known, warnings = unit_and_warnings(cloud, unit, category, what, option)
    for warning in warnings:
        log.warning("%s", warning)
    return known


def unit_and_warnings(
    cloud: PointCloud, unit: str | None, category: str, what: str, option: str
) -> tuple[str, list[str]]:
    """The unit of a cloud, and warnings about it.

    The unit is the one that the file gives, or `unit`, or guessed from the usual size of the
    category. There is a warning for a guess, and for a size that is unusual for the category.
    `what` names the cloud in messages, and `option` the way to give a unit. Raises ProcessError
    where two units contradict each other, or where none is given and the size fits several or none.
    """
    warnings = []
    if unit is not None and cloud.unit not in (None, unit):
        raise ProcessError(f"{what}: {option} is {unit}, but the file says {cloud.unit}")
    size = float(np.ptp(cloud.points, axis=0).max())
    known = unit or cloud.unit
    if known is None:
        known = guess_unit(size, category)
        if known is None:
            raise ProcessError(
                f"{what} does not say its unit, and its longest side, {size:.4g}, does not tell "
                f"it{_usual(category)}: give {option} ({', '.join(METRES)})"
            )
        reason = f"because its longest side is {size:.4g}{_usual(category)}"
        warnings.append(f"{what} does not say its unit; taken to be {known}, {reason}")
    metres = size * METRES[known]
    low, high = USUAL_SIZES.get(category, (0.0, np.inf))
    if not low / _ODD_SIZE <= metres <= high * _ODD_SIZE:
        odd = f"{metres:.4g} m long{_usual(category)}"
        warnings.append(f"{what} is {odd}: is its unit, {known}, right?")
    return known, warnings


def files_of(knowledge: Knowledge, folder: str | Path) -> list[Path]:
    """The files that a knowledge refers to; names are relative to `folder`."""
    names = [knowledge.reference.cloud, *(region.file for region in knowledge.regions)]
    return [Path(folder) / name for name in names if name is not None]


def checksum(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits.

    Raises ProcessError if it is not a regular file, for instance the folder of a bag.
    """
    with open_file(path, ProcessError) as file:
        return sha256_of(file)


def _usual(category: str) -> str:
    if category not in USUAL_SIZES:
        return ""
    low, high = USUAL_SIZES[category]
    return f" (a {category} is usually {low:g} to {high:g} m long)"


def _reference(
    reference: Reference, category: str, folder: Path, origin: str
) -> tuple[PointCloud, str]:
    """The reference's cloud in metres, and the unit of its file."""
    if reference.points_m is not None:
        normals = None if reference.normals is None else _unit_vectors(reference.normals, origin)
        cloud = PointCloud(np.array(reference.points_m, float), normals, "m", reference.frame)
        check_cloud(cloud, MINIMUM_POINTS)
        return cloud, "m"
    path = folder / str(reference.cloud)
    cloud = read_cloud(path)
    found = checksum(path)
    if reference.sha256 not in (None, found):
        raise ProcessError(
            f"{origin}: reference.sha256 is {str(reference.sha256)[:12]}…, but that of {path} is "
            f"{found[:12]}…: it is not the cloud that the regions were taught on. Use that one, or "
            f"mark the regions again and write sha256: {found}"
        )
    if reference.frame is not None and cloud.frame not in (None, reference.frame):
        raise ProcessError(
            f"{origin}: reference.frame is {reference.frame}, but {path} says {cloud.frame}"
        )
    check_cloud(cloud, MINIMUM_POINTS)
    unit = known_unit(cloud, reference.unit, category, str(path), "reference.unit")
    return replace(in_metres(cloud, unit), frame=cloud.frame or reference.frame), unit


def _unit_vectors(vectors: list[tuple[float, float, float]], origin: str) -> np.ndarray:
    normals = np.array(vectors, float)
    length = np.linalg.norm(normals, axis=1)
    if not (np.abs(length - 1) < 0.01).all():
        worst = int(np.abs(length - 1).argmax())
        raise CloudError(
            f"{origin}: reference.normals must have length 1; that of number {worst} is "
            f"{length[worst]:.4g}"
        )
    return np.asarray(normals / length[:, None])


def _given(region: Region, folder: Path, unit: str) -> np.ndarray:
    """A region as `whole_region` takes it, points in metres."""
    if region.file is None:
        ways = (region.mask, region.indices, region.points_m)
        return np.array(next(way for way in ways if way is not None))
    found = read_region_file(folder / region.file, unit)
    if len(found) > 1 and region.name not in found:
        raise ProcessError(f"{region.file} has no region of that name; it has: {', '.join(found)}")
    values = found[region.name] if region.name in found else next(iter(found.values()))
    return values if values.ndim == 1 else values * METRES[unit]
