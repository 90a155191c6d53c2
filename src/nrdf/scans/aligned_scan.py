"""A scan on its way into a model: cleaned, aligned and encoded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from nrdf.field.cloud_encoder import WORKING_POINTS, CloudEncoder
from nrdf.field.encoded_cloud import EncodedCloud
from nrdf.geometry.sampling import downsample
from nrdf.geometry.similarity import Similarity, up_axis
from nrdf.geometry.units import METRES, Unit, find_unit
from nrdf.io.cloud import PointCloud, in_metres
from nrdf.io.inputs import as_cloud
from nrdf.scans.align import Alignment, align_scan
from nrdf.scans.clean import Cleaned, clean_scan, unthinned
from nrdf.scans.kind_check import KindCheck, check_by_network, check_by_scorer
from nrdf.scans.pose_scorer import PoseScorer

_ONE_SIDED = (0.5, 0.9)
"""Symmetry between which the field is shown the mirror image too: the plane is trusted, and what
one of its sides shows the other one lacks."""


@dataclass(frozen=True)
class AlignedScan:
    """A scan, cleaned and aligned.

    scorer: what it was aligned by. scan: as it was read; cleaned: the object in it; alignment: its
    poses; unit: of the scan.
    """

    scorer: PoseScorer
    scan: PointCloud
    cleaned: Cleaned
    alignment: Alignment
    unit: Unit

    @property
    def pose(self) -> Similarity:
        """The likeliest pose: from canonical coordinates to the scan's."""
        return self.alignment.best.pose

    def encode(self) -> EncodedCloud:
        """The object as the model's field sees it, in the likeliest pose.

        Sheets whose side nothing tells stand for both (`EncodedCloud.two_sided`).
        """
        seen = self.scorer.model.encode(self.cleaned.cloud, self.pose, self._is_one_sided)
        return seen.two_sided()

    def encode_in_metres(self, unit: str) -> EncodedCloud:
        """As `encode`, of the object in metres, its scan being in `unit`."""
        pose = self.pose.then(Similarity(np.eye(3), np.zeros(3), METRES[unit]))
        cloud = in_metres(self.cleaned.cloud, unit)
        return self.scorer.model.encode(cloud, pose, self._is_one_sided)

    def unthinned_in_metres(self, unit: str) -> PointCloud:
        """All points of the object that the scan has, thinned or not, in metres, the scan being in
        `unit`: what results are measured against."""
        return in_metres(unthinned(self.scan, self.cleaned), unit)

    @property
    def _is_one_sided(self) -> bool:
        return is_one_sided(self.alignment.best.symmetry)

    @cached_property
    def kind(self) -> KindCheck:
        """Whether the object looks like one of the category, in the likeliest pose."""
        points = self.cleaned.cloud.points
        points = points[downsample(points, WORKING_POINTS, np.random.default_rng(0))]
        points, model = self.pose.to_canonical(points), self.scorer.model
        if model.kind_network is None:
            return check_by_scorer(self.scorer, self.alignment.best.cost, points)
        return check_by_network(model.kind_network, model.category, points, self.pose.rotation)

    @property
    def warnings(self) -> list[str]:
        """What to know before relying on the pose, in whole sentences."""
        found = []
        if self.cleaned.others:
            found.append(
                f"{self.cleaned.others + 1} objects of comparable size are in view; the largest "
                "was taken: crop the scan to take another"
            )
        found += self.kind.warnings
        if self.alignment.is_ambiguous:
            degrees = [f"{np.degrees(c.yaw):.0f}°" for c in self.alignment.likely]
            found.append(
                f"the pose is ambiguous: yaws of {', '.join(degrees)} explain the scan about "
                "equally; look at the picture, or scan more sides"
            )
        if self.alignment.best.symmetry == 0:
            found.append("no mirror plane was found, so yaw and scale are rough; scan more sides")
        if self.unit.warning:
            known = "may be wrong" if self.unit.name else "is unknown"
            found.append(f"the unit {known}: {self.unit.warning}")
        return found


def is_one_sided(symmetry: float) -> bool:
    """Whether the field is shown the mirror image too, by the symmetry of a pose's candidate."""
    low, high = _ONE_SIDED
    return low < symmetry < high


def align(
    model: CloudEncoder,
    scan: Any,
    up: str = "auto",
    sensors: np.ndarray | None = None,
    unit: str | None = None,
    skip: Sequence[str] = (),
    examples: Sequence[Any] = (),
) -> AlignedScan:
    """Clean a scan of one object in any pose, and align it with the model's category.

    For many scans, make one `PoseScorer` and use `clean_and_align`.

    Args:
        model: the category's model, as `nrdf.load_model` gives it.
        scan: what `nrdf.as_cloud` takes: a PointCloud, a path, an array (n, 3), a mesh.
        up: direction in the scan that points up: "x" to "-z", "x y z", or "auto" (the floor's,
            or else searched).
        sensors: (s, 3) where they stood, instead of what the file says.
        unit: instead of the file's.
        skip: steps of cleaning to leave out (`nrdf.scans.clean.STEPS`).
        examples: objects in canonical orientation, instead of members of the category's family.

    Raises:
        CloudError: a direction or step is not known, or no object is left.
        ModelError: the category has no family, and there are no examples.
    """
    direction = None if up == "auto" else up_axis(up)
    scan = as_cloud(scan, "the scan")
    known = [as_cloud(example, "an example") for example in examples]
    return clean_and_align(PoseScorer(model, known), scan, direction, sensors, unit, skip)


def clean_and_align(
    scorer: PoseScorer,
    scan: PointCloud,
    up: np.ndarray | None = None,
    sensors: np.ndarray | None = None,
    unit: str | None = None,
    skip: Sequence[str] = (),
    number: int = 0,
) -> AlignedScan:
    """Clean and align a scan.

    up: (3,) unit in the scan's frame; where it is not given, the floor's, or else searched.
    sensors: (s, 3) where they stood, instead of what the file says. unit: instead of the file's.
    skip: steps of cleaning to leave out; number: of the object that is taken, 0 for the largest.
    Raises CloudError where no object is left.
    """
    scan = replace(
        scan,
        sensors=scan.sensors if sensors is None else sensors,
        unit=scan.unit if unit is None else unit,
    )
    cleaned = clean_scan(scan, up, skip, number=number)
    if up is None and cleaned.floor is not None:
        up = cleaned.floor.normal
    alignment = align_scan(scorer, cleaned.cloud, up)
    longest = alignment.best.pose.scale
    return AlignedScan(
        scorer, scan, cleaned, alignment, find_unit(scan.unit, longest, scorer.model.category)
    )
