"""How a scan stands, and what of it is the object: proposed when it is read, then corrected.

The object stays in its scan's frame, in which tool paths are wanted. Only its pose says what is up
and which way it faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.geometry.canonical import bounding_box
from nrdf.geometry.similarity import Similarity
from nrdf.geometry.units import METRES
from nrdf.io.cloud import PointCloud, in_metres
from nrdf.scans.aligned_scan import AlignedScan, clean_and_align, is_one_sided
from nrdf.scans.clean import STEPS, Step
from nrdf.scans.pose_scorer import PoseScorer
from nrdf.serve.scan_input import alignment_examples

if TYPE_CHECKING:
    from nrdf.regions.model import Model

AS_IN_FILE = "as in the file"
CLEANED = STEPS[2:]
"""Steps of cleaning that a person can take back: floor, outliers, other objects."""
_MOST_POSES = 4
_LEAST_PROBABILITY = 0.005
_SAME_RAD = np.radians(25)
_QUARTERS = {
    "Left": ("y", -1), "Right": ("y", 1), "Forward": ("z", -1), "Back": ("z", 1),
    "Clockwise": ("x", -1), "Anticlockwise": ("x", 1),
}  # fmt: skip
TURNS = tuple(_QUARTERS)
"""Quarter turns of an object as it is seen from its front."""


@dataclass(frozen=True)
class Pose:
    """A pose that an object may have. similarity: from canonical coordinates to the scan's, m;
    probability: None for one that was not worked out; symmetry: as of `nrdf.scans.align`."""

    similarity: Similarity
    probability: float | None = None
    symmetry: float = 0.0

    @property
    def one_sided(self) -> bool:
        """Whether one side shows what the other one lacks."""
        return is_one_sided(self.symmetry)

    @property
    def words(self) -> str:
        """What a person reads."""
        return AS_IN_FILE if self.probability is None else f"{self.probability:.0%}"


@dataclass(frozen=True)
class Placement:
    """How an object stands in its scan.

    pose: the chosen one; poses: those proposed, the likeliest first, and at last that of the file.
    steps: what cleaning did; skipped: steps that were taken back; number, count: which of how many
    objects of the scan it is, 0 for the largest. warnings: what to look at, until a person has
    `confirmed` the pose.
    """

    pose: Pose
    poses: tuple[Pose, ...]
    steps: tuple[Step, ...] = ()
    skipped: tuple[str, ...] = ()
    number: int = 0
    count: int = 1
    warnings: tuple[str, ...] = ()
    confirmed: bool = False

    @property
    def upright(self) -> np.ndarray:
        """(3, 3) from the scan's axes to those in which +X is the front and +Y is up."""
        return self.pose.similarity.rotation.T


@dataclass(frozen=True)
class PlacedScan:
    """A scan, in metres; the object in it, in the same frame; and how that stands."""

    scan: PointCloud
    cloud: PointCloud
    placement: Placement


def place_scan(
    scan: PointCloud,
    model: Model,
    reference: PointCloud,
    what: str,
    unit: str | None = None,
    skipped: Sequence[str] = (),
    number: int = 0,
) -> PlacedScan:
    """Clean a scan, and propose how its object stands.

    reference: an object of the category, to align by where nothing else is known of it. what: the
    scan's name, for messages. unit: where the file does not say it. skipped: steps of cleaning to
    leave out; number: which object to take. Raises CloudError where no object is left, and
    ProcessError where nothing tells the unit.
    """
    if unit is not None and scan.unit not in (None, unit):
        raise ProcessError(f"{what}: the unit is {unit}, but the file says {scan.unit}")
    scorer = PoseScorer(model, alignment_examples(model, reference))
    found = clean_and_align(scorer, scan, None, None, unit, skipped, number)
    known = _unit(found, what)
    cloud = found.unthinned_in_metres(known)
    poses = [
        Pose(_in_metres(c.pose, known), c.probability, c.symmetry)
        for c in found.alignment.candidates[:_MOST_POSES] if c.probability >= _LEAST_PROBABILITY
    ]  # fmt: skip
    guessed = found.unit.origin == "guessed"
    said = [f"{what} does not say its unit; taken to be {known}, by its size"] if guessed else []
    placement = Placement(
        poses[0], (*poses, framed(cloud.points, np.eye(3))), found.cleaned.steps, tuple(skipped),
        number, found.cleaned.others + 1, (*said, *found.warnings),
    )  # fmt: skip
    return PlacedScan(in_metres(scan, known), cloud, placement)


def framed(points: np.ndarray, rotation: np.ndarray) -> Pose:
    """The pose of points (n, 3) with that rotation (3, 3), by their bounding box."""
    low, high = bounding_box(points @ rotation)
    centre = rotation @ ((low + high) / 2)
    return Pose(Similarity(rotation, centre, float((high - low).max())))


def turned(placement: Placement, points: np.ndarray, turn: str) -> Placement:
    """The placement after a quarter turn, one of `TURNS`, of the object (n, 3) as it is seen."""
    axis, sign = _QUARTERS[turn]
    quarter = Rotation.from_euler(axis, sign * 90, degrees=True).as_matrix().round()
    rotation = placement.pose.similarity.rotation @ quarter.T
    same = [p for p in placement.poses if _angle(p.similarity.rotation, rotation) < 1e-6]
    return replace(placement, pose=same[0] if same else framed(points, rotation))


def with_rotation_of(placement: Placement, earlier: Placement, points: np.ndarray) -> Placement:
    """The placement with the pose that a person had chosen, if it still is among the likely ones
    or was turned by hand."""
    if not earlier.confirmed and earlier.pose is earlier.poses[0]:
        return placement
    rotation = earlier.pose.similarity.rotation
    near = [p for p in placement.poses if _angle(p.similarity.rotation, rotation) < _SAME_RAD]
    return replace(placement, pose=near[0] if near else framed(points, rotation))


def removed_points(scan: PointCloud, cloud: PointCloud) -> np.ndarray:
    """The points (k, 3) of a scan that are not of its object."""
    one, other = (
        np.ascontiguousarray(c.points).view(np.dtype((np.void, 24))).ravel() for c in (scan, cloud)
    )
    return scan.points[~np.isin(one, other)]


def _in_metres(pose: Similarity, unit: str) -> Similarity:
    return pose.then(Similarity(np.eye(3), np.zeros(3), METRES[unit]))


def _unit(found: AlignedScan, what: str) -> str:
    unit = found.unit
    if unit.name is None or (unit.origin == "guessed" and unit.warning):
        why = f" ({unit.warning})" if unit.warning else ""
        raise ProcessError(f"{what} does not say its unit{why}: choose one of {', '.join(METRES)}")
    return unit.name


def _angle(one: np.ndarray, two: np.ndarray) -> float:
    return float(np.arccos(np.clip((np.trace(one.T @ two) - 1) / 2, -1, 1)))
