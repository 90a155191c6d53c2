"""What retrieval finds: a region on a target, and the mapped reference points behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nrdf.field.base import Inverse
from nrdf.regions.presence import Presence
from nrdf.scans.aligned_scan import AlignedScan

TRUST_SCALE = 0.2
"""Canonical distance at which trust has fallen to 1/e: from a target point to the mapped reference,
and of the error that the field expects of itself."""
FOUND = Presence("", 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Match:
    """A region found on a target, or the reason why it was not.

    indices: (k,) the target's own points in the region, ascending; none where `presence` has a
        reason.
    points: (m, 3) where C puts each point of the reference's region, in its order, in the
        target's frame and unit (raw prediction, off the surface by the field's error).
    confidence: (k,) in [0, 1], for each of `indices`; their mean is the overlap with the true
        region that is to be expected (`nrdf.regions.presence`).
    method: "mask" or "points"; "marked" where a person has marked it on the target.
    presence: whether the target has the region and the scan shows it.
    """

    indices: np.ndarray
    points: np.ndarray
    confidence: np.ndarray
    method: str
    presence: Presence = FOUND

    @property
    def score(self) -> float:
        """Mean confidence of the region's points; 0 for an empty region."""
        return float(self.confidence.mean()) if len(self.confidence) else 0.0

    def in_scan(self, aligned: AlignedScan) -> Match:
        """This match, found on an aligned scan's object, with indices of the scan's own points."""
        return replace(self, indices=aligned.cleaned.kept[self.indices])

    def with_presence(self, presence: Presence, drop_absent: bool = True) -> Match:
        """This match, its confidence scaled to the overlap that is to be expected; with
        `drop_absent` without its points where the region is not there or was not seen."""
        if not (presence.reason and drop_absent):
            scaled = self.confidence * (presence.overlap / max(self.score, 1e-9))
            return replace(self, presence=presence, confidence=np.minimum(scaled, 1.0))
        return replace(
            self, indices=self.indices[:0], confidence=self.confidence[:0], presence=presence
        )


class MappedPoints(NamedTuple):
    """Reference points on a target, canonical: points (m, 3), normals (m, 3), existence (m,) in
    [0, 1] (does the target have such a place?), error (m,) that the field expects; 1 and 0 for a
    field that says nothing of the kind. moved: (m, 3), how far refinement has moved the points."""

    points: np.ndarray
    normals: np.ndarray
    existence: np.ndarray
    error: np.ndarray
    moved: np.ndarray

    def shifted(self, moved: np.ndarray) -> MappedPoints:
        """The same, moved by (m, 3)."""
        return self._replace(points=self.points + moved, moved=self.moved + moved)

    @property
    def trust(self) -> np.ndarray:
        """(m,) in [0, 1]: that the place exists, and how small an error is expected."""
        return self.existence * np.exp(-self.error / TRUST_SCALE)

    def select(self, chosen: np.ndarray) -> MappedPoints:
        """The points at `chosen`, integers (k,) or a mask (m,)."""
        return MappedPoints(*(values[chosen] for values in self))


def mapped_points(inverse: Inverse, normals: np.ndarray) -> MappedPoints:
    """What C says of one target's points, with what it leaves open: the `normals` (m, 3) that the
    points had on the reference, existence certain, no error."""
    count = len(normals)
    return MappedPoints(
        inverse.points[0].cpu().numpy(),
        normals if inverse.normals is None else inverse.normals[0].cpu().numpy(),
        np.ones(count, np.float32)
        if inverse.existence is None
        else inverse.existence[0].sigmoid().cpu().numpy(),
        np.zeros(count, np.float32)
        if inverse.log_error is None
        else inverse.log_error[0].exp().cpu().numpy(),
        np.zeros((count, 3), np.float32),
    )
