"""A region that was found on a target: the result of retrieval."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from nrdf.regions.presence import Presence
from nrdf.scans.aligned_scan import AlignedScan

FOUND = Presence("", 1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Match:
    """A region found on a target, or the reason why it was not.

    Attributes:
        indices: (k,) the target's own points in the region, ascending; none where `presence` has
            a reason.
        points: (m, 3) where C puts each point of the reference's region, in its order, in the
            target's frame and unit (raw prediction, off the surface by the field's error).
        confidence: (k,) in [0, 1], for each of `indices`; their mean is the overlap with the true
            region that is to be expected (`nrdf.regions.presence`).
        method: "mask" or "points"; "marked" where a person has marked it on the target.
        presence: whether the target has the region and the scan shows it.
        working: (w,) the same region as indices of the encoded target's working points,
            ascending.
    """

    indices: np.ndarray
    points: np.ndarray
    confidence: np.ndarray
    method: str
    presence: Presence = FOUND
    working: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))

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
            self,
            indices=self.indices[:0],
            confidence=self.confidence[:0],
            presence=presence,
            working=self.working[:0],
        )
