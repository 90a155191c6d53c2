"""Presence of a region on a target: whether it is there, and the overlap to be expected.

A region that is not there must not come back as some other part. What is known after retrieval is
put into one number, the overlap with the true region that is to be expected. It is low where the
field predicts that points do not exist, where little was found and with little trust, and where
what was found maps back to other parts of the reference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

ABSENT, NOT_OBSERVED = "absent", "not observed"

_SEEN = 0.08  # distance within which a mapped point was observed
_LEAST_SEEN = 0.05  # share of a region's mapped points that makes it observed
_SHOWN = 0.5  # share of all mapped points that lie where the scan has points, for absence
_LEAST_SHARE = 0.02  # that counts as the least
_SURE = 0.02  # shares of 0 and 1 are as sure as this


class Evidence(NamedTuple):
    """What is known of a region after retrieval; 0 is even odds, and full size.

    existence: log odds that its points exist on the target, of their mean. trust: log odds of the
    mean confidence of the points that were found. size: logarithm of how much was found, compared
    with what the region has of the reference; 0 where it was as much or more. returned: log odds
    that a point that was found maps back into the region on the reference.
    """

    existence: float
    trust: float
    size: float
    returned: float


@dataclass(frozen=True)
class PresenceRule:
    """Overlap to be expected of evidence: 1 / (1 + exp(-(bias + weights @ evidence)))."""

    bias: float
    weights: tuple[float, ...]

    def overlap(self, evidence: np.ndarray) -> np.ndarray:
        """(n,) in [0, 1] for evidence (n, e)."""
        return np.asarray(1 / (1 + np.exp(-self.bias - evidence @ np.array(self.weights))))


# Logistic regressions of the overlap with the true region, 0 where the target lacks it, on parts
# of labelled real objects and on members of families, whole and in scans of three views: what
# `nrdf eval presence` prints (docs/evidence/scans.md). The field's holds for the general model as
# well, which it was not fitted on: one that was is no better (docs/evidence/general.md).
FIELD_RULE = PresenceRule(-0.81, Evidence(existence=0.23, trust=0.68, size=0.97, returned=0.43))
REGISTRATION_RULE = PresenceRule(
    0.39, Evidence(existence=0.35, trust=1.09, size=2.29, returned=-0.05)
)
SURELY_ABSENT = 0.02
"""Overlap to be expected below which a region is taken to be absent, and comes back empty."""


@dataclass(frozen=True)
class Presence:
    """What became of a region: reason "" where it was found, `ABSENT` or `NOT_OBSERVED` where not.

    confidence: in [0, 1], that this is so. overlap: in [0, 1], intersection over union of what was
    found and the true region, as it is to be expected. observed: share of the region's mapped
    points that lie where the scan has points. evidence: what this was computed from, None where
    nothing was.
    """

    reason: str
    confidence: float
    overlap: float
    observed: float
    evidence: Evidence | None = None


def evidence_of(existence: np.ndarray, trust: float, size: float, returned: float) -> Evidence:
    """Evidence from what is known of a region's m mapped points and of what was found.

    existence: (m,) probabilities, 1 from a field that says nothing of the kind. trust: mean
    confidence of the points found; size: their share of the target over the region's share of the
    reference; returned: share of them that maps back into the region.
    """
    return Evidence(
        _log_odds(float(existence.mean())),
        _log_odds(trust),
        float(np.log(np.clip(size, _LEAST_SHARE, 1.0))),
        _log_odds(returned),
    )


def find_presence(
    evidence: Evidence,
    distance: np.ndarray,
    whole_distance: np.ndarray,
    rule: PresenceRule = FIELD_RULE,
) -> Presence:
    """Presence of a region on a target, by the rule of what mapped it.

    distance: (m,) of its mapped points from the target's, canonical, in position and weighted
    normal; whole_distance: (n,) of the whole reference's. Where the scan shows less than half of
    what it should, no region is surely absent: what is missing may be hidden.
    """
    observed = _observed(distance)
    overlap = float(rule.overlap(np.array(evidence)))
    if overlap < SURELY_ABSENT and _observed(whole_distance) >= _SHOWN:
        return Presence(ABSENT, 1 - overlap, overlap, observed, evidence)
    if observed < _LEAST_SEEN:
        return Presence(NOT_OBSERVED, 1 - observed, overlap, observed, evidence)
    return Presence("", overlap, overlap, observed, evidence)


def _observed(distance: np.ndarray) -> float:
    return float((distance < _SEEN).mean())


def _log_odds(share: float) -> float:
    share = float(np.clip(share, _SURE, 1 - _SURE))
    return float(np.log(share / (1 - share)))
