"""Whether a target has a region at all, and whether the scan shows it.

A region that is not there must not come back as some other part. Two things speak for absence: the
field's own estimate that the places exist, and mapped points of which not even the nearest ones lie
on the target's surface. That the others don't only says that the scan may not have seen them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ABSENT, NOT_OBSERVED = "absent", "not observed"

# A logistic regression on 150 pairs of family members, with fields that came before the zoo's of
# today. `nrdf eval presence` fits it anew: that tells no more than this (docs/scans.md). It leaves
# every region of BSRC that exists clear of being emptied. What the field expects as its error adds
# nothing to these two.
_BIAS, _EXISTENCE, _DISTANCE = 0.77, -1.88, 1.45
_NEAREST = 0.2  # share of the mapped points whose distance counts
_USUAL_DISTANCE = 0.05  # canonical, in position and weighted normal
_SEEN = 0.08  # distance within which a mapped point was observed
_LEAST_SEEN = 0.1  # share of a region's mapped points that makes it observed


@dataclass(frozen=True)
class Presence:
    """What became of a region: reason "" where it was found, `ABSENT` or `NOT_OBSERVED` where not.

    confidence: in [0, 1], that this is so; observed: share of its mapped points that lie where the
    scan has points. evidence: what absence was judged by (`evidence_of`).
    """

    reason: str
    confidence: float
    observed: float
    evidence: tuple[float, float] = (0.0, 0.0)


def evidence_of(existence: np.ndarray, distance: np.ndarray) -> tuple[float, float]:
    """What is known of a region's absence: the log odds that its places exist, and the logarithm of
    how far even the nearest of its mapped points are off the target, in usual distances.

    existence, distance: (m,) as for `find_presence`.
    """
    share = float(np.clip(existence.mean(), 1e-3, 1 - 1e-3))
    off = max(float(np.quantile(distance, _NEAREST)), 1e-3) / _USUAL_DISTANCE
    return float(np.log(share / (1 - share))), float(np.log(off))


def find_presence(existence: np.ndarray, distance: np.ndarray) -> Presence:
    """Presence of a region on a target from what is known of its m mapped points.

    existence: (m,) probabilities, 1 from a field that says nothing of the kind; distance: (m,) of
    the mapped points from the target's points, canonical, in position and weighted normal.
    """
    evidence = evidence_of(existence, distance)
    score = _BIAS + _EXISTENCE * evidence[0] + _DISTANCE * evidence[1]
    absent = float(1 / (1 + np.exp(-score)))
    observed = float((distance < _SEEN).mean())
    if absent > 0.5:
        return Presence(ABSENT, absent, observed, evidence)
    if observed < _LEAST_SEEN:
        return Presence(NOT_OBSERVED, (1 - absent) * (1 - observed), observed, evidence)
    return Presence("", 1 - absent, observed, evidence)
