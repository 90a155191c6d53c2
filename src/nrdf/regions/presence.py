"""Whether a target has a region at all, and whether the scan shows it.

A region that is not there must not come back as some other part. Three things speak for absence:
the field's own estimate that the places exist, an expected error above that of the rest of the
reference, and mapped points that lie off the target's surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ABSENT, NOT_OBSERVED = "absent", "not observed"

# Weights of a logistic regression on 861 regions of 80 pairs of family chairs and 994 of aircraft
# and cars (seeds from 1,000,000), that bear names their target lacks or has.
_EXISTENCE, _ERROR, _DISTANCE, _BIAS = -1.24, 2.59, 3.03, -2.18
_USUAL_DISTANCE = 0.05  # canonical, of the 80 % quantile of the mapped points from the target
_SEEN = 0.06  # distance (position and weighted normal) within which a mapped point was observed
_SURE = 0.8  # probability of absence from which a region is emptied: worse than one too many is one
# that is there and not found, and the regression is older than the zoo's chairs and planes
_LEAST_SEEN = 0.2  # share of a region's mapped points that makes it observed


@dataclass(frozen=True)
class Presence:
    """What became of a region: reason "" where it was found, `ABSENT` or `NOT_OBSERVED` where not.

    confidence: in [0, 1], that this is so; observed: share of its mapped points that lie where the
    scan has points.
    """

    reason: str
    confidence: float
    observed: float


def find_presence(
    existence: np.ndarray, error: np.ndarray, usual_error: float, distance: np.ndarray
) -> Presence:
    """Presence of a region on a target from what the field says of its m mapped points.

    existence: (m,) probabilities; error: (m,) expected; `usual_error`, the median over the whole
    reference, canonical, 0 where the field expects none; distance: (m,) of the mapped points from
    the target's points, in position and weighted normal.
    """
    share = float(np.clip(existence.mean(), 1e-3, 1 - 1e-3))
    off = max(float(np.quantile(distance, 0.8)), 1e-3) / _USUAL_DISTANCE
    score = _BIAS + _EXISTENCE * np.log(share / (1 - share)) + _DISTANCE * np.log(off)
    if usual_error > 0:
        score += _ERROR * float(np.log(error / usual_error).mean())
    absent = float(1 / (1 + np.exp(-score)))
    observed = float((distance < _SEEN).mean())
    if absent > _SURE:
        return Presence(ABSENT, absent, observed)
    if observed < _LEAST_SEEN:
        return Presence(NOT_OBSERVED, (1 - absent) * (1 - observed), observed)
    return Presence("", 1 - absent, observed)
