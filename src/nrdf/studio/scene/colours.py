"""The colours of an object's points: regions, confidence, similarity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.viz.palette import NO_REGION, SEVERAL_REGIONS, confidence_scale, similarity_scale

COLOURINGS = ("regions", "confidence", "similarity")
"""What the colours of points can show."""
BARE = np.array(NO_REGION) * 255


def painted_colours(
    count: int, regions: Sequence[tuple[tuple[int, int, int], np.ndarray, np.ndarray | None]]
) -> np.ndarray:
    """Colours (n, 3) uint8 of points by their regions, each (colour, indices (k,), confidence (k,)
    or None): paler where less certain, dark where several have a point."""
    drawn = np.tile(BARE, (count, 1))
    times = np.zeros(count, np.int64)
    for colour, indices, confidence in regions:
        strength = np.ones(len(indices)) if confidence is None else 0.2 + 0.8 * confidence
        mixed = strength[:, None] * colour + (1 - strength[:, None]) * 255
        drawn[indices] = mixed
        times[indices] += 1
    drawn[times > 1] = SEVERAL_REGIONS
    return drawn.astype(np.uint8)


def confidence_colours(count: int, regions: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Colours (n, 3) uint8 of points by their confidence: red 0, yellow 0.5, green 1.

    regions: (indices (k,), confidence (k,)) each.
    """
    drawn = np.tile(BARE, (count, 1))
    for indices, confidence in regions:
        drawn[indices] = confidence_scale(confidence)
    return drawn.astype(np.uint8)


def similarity_colours(distance: np.ndarray, width: float) -> np.ndarray:
    """Colours (n, 3) uint8 by the similarity of descriptors: yellow where equal, blue where not.

    distance: (n,) descriptor distances; width: the distance at which the similarity is 1/e.
    """
    return similarity_scale(np.exp(-((distance / max(width, 1e-6)) ** 2)))
