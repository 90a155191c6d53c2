"""The colours of an object's points: regions, confidence, likeness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nrdf.viz.picture import BASE_COLOUR, PALETTE

COLOURINGS = ("regions", "confidence", "likeness")
"""What the colours of points may show."""
BARE = np.array(BASE_COLOUR) * 255
SHARED = np.array([30.0, 30.0, 34.0])
"""Points of more than one region."""
SURE, DOUBTED = np.array([26.0, 152.0, 80.0]), np.array([215.0, 48.0, 39.0])
_MIDDLE = np.array([254.0, 224.0, 139.0])
_COLD, _HOT = np.array([49.0, 54.0, 149.0]), np.array([253.0, 231.0, 37.0])


def next_colour(taken: Sequence[tuple[int, int, int]]) -> tuple[int, int, int]:
    """The first colour of the palette that no region has."""
    colours = [_rgb(c) for c in PALETTE]
    return next((c for c in colours if c not in taken), colours[len(taken) % len(colours)])


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
    drawn[times > 1] = SHARED
    return drawn.astype(np.uint8)


def confidence_colours(count: int, regions: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Colours (n, 3) uint8 of points by their confidence: red 0, yellow 0.5, green 1.

    regions: (indices (k,), confidence (k,)) each.
    """
    drawn = np.tile(BARE, (count, 1))
    for indices, confidence in regions:
        share = np.clip(confidence, 0.0, 1.0)[:, None]
        low = DOUBTED + 2 * np.minimum(share, 0.5) * (_MIDDLE - DOUBTED)
        drawn[indices] = np.where(share <= 0.5, low, _MIDDLE + (2 * share - 1) * (SURE - _MIDDLE))
    return drawn.astype(np.uint8)


def similarity_colours(distance: np.ndarray, width: float) -> np.ndarray:
    """Colours (n, 3) uint8 by how alike descriptors are: yellow where the same, blue where not.

    distance: (n,) descriptor distances; width: the distance at which the similarity is 1/e.
    """
    alike = np.exp(-((distance / max(width, 1e-6)) ** 2))[:, None]
    return (_COLD + alike * (_HOT - _COLD)).astype(np.uint8)


def _rgb(text: str) -> tuple[int, int, int]:
    return (int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16))
