"""Whether a target has a region at all, and whether the scan shows it.

A region that is not there must not come back as some other part. Three things speak for absence:
the field's own estimate that the places exist, an expected error above that of the rest of the
reference, and mapped points of which not even the nearest ones lie on the target's surface. That
the others don't only says that the scan may not have seen them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ABSENT, NOT_OBSERVED = "absent", "not observed"

# Logistic regression on the regions of 140 pairs of family members (seeds from 1,000,000; chairs,
# aircraft, cars), whole and in simulated scans of three views and of one.
_BIAS, _EXISTENCE, _ERROR, _DISTANCE = -0.8, -1.45, 4.1, 1.5
_NEAREST = 0.2  # share of the mapped points whose distance counts
_USUAL_DISTANCE = 0.05  # canonical, in position and weighted normal
_SEEN = 0.08  # distance within which a mapped point was observed
_LEAST_SEEN = 0.1  # share of a region's mapped points that makes it observed


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
    exists: np.ndarray, error: np.ndarray, usual_error: float, distance: np.ndarray
) -> Presence:
    """Presence of a region on a target from what the field says of its m mapped points.

    exists: (m,) probabilities; error: (m,) expected, and `usual_error`, the median over the whole
    reference, canonical, 0 where the field expects none; distance: (m,) of the mapped points from
    the target's points, in position and weighted normal.
    """
    share = float(np.clip(exists.mean(), 1e-3, 1 - 1e-3))
    off = max(float(np.quantile(distance, _NEAREST)), 1e-3) / _USUAL_DISTANCE
    score = _BIAS + _EXISTENCE * np.log(share / (1 - share)) + _DISTANCE * np.log(off)
    if usual_error > 0:
        score += _ERROR * float(np.log(error / usual_error).mean())
    absent = float(1 / (1 + np.exp(-score)))
    observed = float((distance < _SEEN).mean())
    if absent > 0.5:
        return Presence(ABSENT, absent, observed)
    if observed < _LEAST_SEEN:
        return Presence(NOT_OBSERVED, (1 - absent) * (1 - observed), observed)
    return Presence("", 1 - absent, observed)
