"""The colours of an object's points: regions, confidence, similarity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.studio.model.document import PaintedRegion
from nrdf.viz.heat_map import COLOURS
from nrdf.viz.palette import NO_REGION, SEVERAL_REGIONS, confidence_scale, similarity_scale

RESULT = "film or depth"
COLOURINGS = ("regions", "confidence", "similarity", RESULT)
"""What colours can show."""
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


def legend_of(colouring: str, regions: Sequence[PaintedRegion]) -> list[tuple[str, str]]:
    """What the colours of objects mean: (words, colour in hexadecimal) each."""
    if colouring == "regions":
        several = [("in several regions", hexadecimal(np.array(SEVERAL_REGIONS)))]
        own = [(region.name, hexadecimal(np.array(region.colour))) for region in regions]
        return own + (several if len(regions) > 1 else [])
    if colouring == RESULT:
        ends = ("far too little", COLOURS[0]), ("far too much", COLOURS[-1])
        return [ends[0], ("wanted", COLOURS[len(COLOURS) // 2]), ends[1]]
    scale = confidence_scale if colouring == "confidence" else similarity_scale
    words = {1.0: f"{colouring} 1", 0.5: "0.5", 0.0: "0"}
    return [(w, hexadecimal(scale(np.array([v]))[0])) for v, w in words.items()]


def hexadecimal(colour: np.ndarray) -> str:
    """A colour (3,), 0 to 255, as "#rrggbb"."""
    return "#" + "".join(f"{int(value):02x}" for value in colour)
