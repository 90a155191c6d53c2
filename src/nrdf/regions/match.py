"""What retrieval finds: a region on a target, and the mapped reference points behind it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from nrdf.field.base import Inverse
from nrdf.regions.presence import Presence

ERROR_SCALE = 0.2
"""Expected error, canonical, at which trust has fallen to 1/e. Chosen on unseen family chairs, so
that confidence is about the share of points that are right."""
FOUND = Presence("", 1.0, 1.0)


@dataclass(frozen=True)
class Match:
    """A region found on a target, or the reason why it was not.

    indices: (k,) the target's own points in the region, ascending; none where `presence` has a
        reason.
    points: (m, 3) where C puts each point of the reference's region, in its order, in the
        target's frame and unit (raw prediction, off the surface by the field's error).
    confidence: (k,) in [0, 1], for each of `indices`.
    method: "mask" or "points".
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

    def with_presence(self, presence: Presence) -> Match:
        """This match, without its points where the region is not there or was not seen."""
        if not presence.reason:
            return replace(self, presence=presence)
        return replace(
            self, indices=self.indices[:0], confidence=self.confidence[:0], presence=presence
        )


class Mapped(NamedTuple):
    """Reference points on a target, canonical: points (m, 3), normals (m, 3), exists (m,) the
    probability that the target has the place, error (m,) that the field expects of itself."""

    points: np.ndarray
    normals: np.ndarray
    exists: np.ndarray
    error: np.ndarray

    @property
    def trust(self) -> np.ndarray:
        """(m,) in [0, 1]: that the place exists, and how small an error is expected."""
        return self.exists * np.exp(-self.error / ERROR_SCALE)

    def select(self, chosen: np.ndarray) -> Mapped:
        """The points at `chosen`, integers (k,) or a mask (m,)."""
        return Mapped(*(values[chosen] for values in self))


def mapped_points(inverse: Inverse, normals: np.ndarray) -> Mapped:
    """What C says of one target's points, with what it leaves open: the `normals` (m, 3) that the
    points had on the reference, existence certain, no error."""
    count = len(normals)
    return Mapped(
        inverse.points[0].cpu().numpy(),
        normals if inverse.normals is None else inverse.normals[0].cpu().numpy(),
        np.ones(count)
        if inverse.existence is None
        else inverse.existence[0].sigmoid().cpu().numpy(),
        np.zeros(count) if inverse.log_error is None else inverse.log_error[0].exp().cpu().numpy(),
    )
