"""Warped waypoints against the exact truth of the parametric families, on unseen members.

Rasters are planned on every region of a reference and warped to another member as `nrdf transfer`
does it. Members are canonical: lengths are shares of an object's longest side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nrdf.errors import DataError, ProcessError
from nrdf.field.encoded_cloud import NORMAL_WEIGHT
from nrdf.geometry.frames import z_axes
from nrdf.geometry.normals import oriented_features, oriented_tree
from nrdf.io.cloud import PointCloud
from nrdf.process.bound_knowledge import BoundKnowledge
from nrdf.process.correspondence import Correspondence
from nrdf.process.knowledge import Knowledge
from nrdf.process.transfer import ProcessTransfer
from nrdf.process.warp import warp_segments
from nrdf.regions.model import Model
from nrdf.shapes.families import Family, SurfaceSample, get_family
from nrdf.shapes.families.member import Member
from nrdf_benchmark.families import CLOUD_POINTS, FIRST_SEED

SMALLEST_REGION = 60
"""Points of the reference's cloud that a region needs to get a raster."""
_PRESENT = 20  # points of the target's cloud from which on it has a region
_TRUTH_POINTS = 40_000
_RASTER = {
    "kind": "custom", "name": "raster", "transfer": "warp", "stepover_m": 0.03,
    "spacing_m": 0.01, "tool": {"radius_m": 0.025}, "feed_m_s": 0.1,
}  # fmt: skip


@dataclass(frozen=True)
class WarpResult:
    """Waypoints and regions of all pairs.

    errors: for each pair the distances (w,) of warped waypoints from their true positions, where
    these exist. lost: share of the waypoints with a true position that were not warped. invented:
    share of those without one that were warped, in regions that the target has. confidence: (r,)
    of every region on every target; present: (r,) whether the target has it.
    """

    category: str
    errors: tuple[np.ndarray, ...]
    lost: float
    invented: float
    confidence: np.ndarray
    present: np.ndarray

    @property
    def medians(self) -> np.ndarray:
        """The median error of each pair, (pairs,)."""
        return np.array([np.median(errors) for errors in self.errors])

    def kept(self, min_confidence: float, present: bool) -> float:
        """Share of the regions that targets have (or lack) with at least that confidence."""
        asked = self.confidence[self.present == present]
        return float((asked >= min_confidence).mean()) if len(asked) else float("nan")


def evaluate_warp(
    model: Model,
    category: str,
    pairs: int = 50,
    progress: Callable[[int, int], None] | None = None,
) -> WarpResult:
    """Warp rasters on every region between `pairs` pairs of unseen members.

    `progress` is told (done, all). Raises DataError for a category without a family, or no pairs.
    """
    if pairs < 1:
        raise DataError(f"{pairs} pairs asked for; give at least 1")
    family = get_family(category)
    errors, counts, confidence, present = [], np.zeros(4), [], []
    for number in range(pairs):
        reference = family.member(FIRST_SEED + 2 * number)
        target = family.member(FIRST_SEED + 2 * number + 1)
        rng = np.random.default_rng(FIRST_SEED + number)
        here = reference.sample_surface(CLOUD_POINTS, rng)
        there = target.sample_surface(CLOUD_POINTS, rng)
        process_transfer = ProcessTransfer(_raster_knowledge(category, family, here), model)
        encoded = model.encode(PointCloud(there.points, there.normals))
        correspondence = Correspondence(process_transfer.reference_surface, encoded)
        matches = process_transfer.reference.retrieve_all(
            process_transfer.bound_knowledge.regions, encoded
        )
        named = family.region_of(there.coordinates)
        truth = _Truth(reference, target, rng)
        found = []
        for name in matches:
            has = int((named == name).sum())
            confidence.append(matches[name].score)
            present.append(has >= _PRESENT)
            if has >= _PRESENT:
                warped = _warped(process_transfer, correspondence, name, truth)
                if warped is not None:
                    found.append(warped[0])
                    counts += warped[1]
        errors.append(np.concatenate(found) if found else np.zeros(0))
        if progress is not None:
            progress(number + 1, pairs)
    lost, existing, invented, absent = counts
    return WarpResult(
        category,
        tuple(e for e in errors if len(e)),
        lost / max(existing, 1),
        invented / max(absent, 1),
        np.array(confidence),
        np.array(present),
    )


def _raster_knowledge(category: str, family: Family, surface: SurfaceSample) -> BoundKnowledge:
    """A raster on every region of a reference that is large enough."""
    named = family.region_of(surface.coordinates)
    regions = {
        name: np.flatnonzero(named == name)
        for name in family.region_names
        if (named == name).sum() >= SMALLEST_REGION
    }
    rows = [
        {"name": name, "indices": indices.tolist(), "processes": [_RASTER]}
        for name, indices in regions.items()
    ]
    content = {"category": category, "reference": {"cloud": "reference"}, "regions": rows}
    cloud = PointCloud(surface.points, surface.normals, unit="m")
    return BoundKnowledge(Knowledge.model_validate(content), cloud, regions)


class _Truth:
    """Where points of one member are on another: by the nearest of many exact pairs."""

    def __init__(self, reference: Member, target: Member, rng: np.random.Generator) -> None:
        dense = reference.sample_surface(_TRUTH_POINTS, rng)
        located = target.locate(dense.coordinates)
        self._points, self._there, self._exists = dense.points, located.points, located.exists
        self._tree = oriented_tree(dense.points, dense.normals, NORMAL_WEIGHT)

    def positions(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The true positions (m, 3) of points (m, 3) with normals (m, 3), and which exist (m,)."""
        nearest = self._tree.query(oriented_features(points, normals, NORMAL_WEIGHT))[1]
        return self._there[nearest] + points - self._points[nearest], self._exists[nearest]


def _warped(
    process_transfer: ProcessTransfer, correspondence: Correspondence, name: str, truth: _Truth
) -> tuple[np.ndarray, np.ndarray] | None:
    """Errors (w,) of one region's warped waypoints; and how many were lost of how many that
    exist, invented of how many that do not. None where no raster fits the region."""
    try:
        segments = process_transfer.reference_segments(name, 0)
    except ProcessError:
        return None
    warped, _ = warp_segments(correspondence, segments, _RASTER["tool"]["radius_m"])  # type: ignore[index]
    errors, counts = [], np.zeros(4)
    arrived = [np.full((len(segment.positions), 3), np.nan) for segment in segments]
    for segment in warped:
        arrived[segment.line][segment.source] = segment.positions
    for planned, there in zip(segments, arrived, strict=True):
        outward = -_tool_z(planned.quaternions_xyzw)
        exact, exists = truth.positions(planned.positions, outward)
        has = np.isfinite(there[:, 0])
        errors.append(np.linalg.norm(there - exact, axis=1)[has & exists])
        counts += [(exists & ~has).sum(), exists.sum(), (~exists & has).sum(), (~exists).sum()]
    return np.concatenate(errors), counts


def _tool_z(quaternions_xyzw: np.ndarray) -> np.ndarray:
    return z_axes(quaternions_xyzw)
