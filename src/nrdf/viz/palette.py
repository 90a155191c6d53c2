"""Colours: of regions, of confidence and similarity, and of what a robot reaches.

Colours of regions are floats in [0, 1]; scales give uint8, as viewers of point clouds take them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

REGION_COLOURS = (
    "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#F0E442",
    "#882255", "#44AA99", "#999933", "#332288", "#AA4499",
)  # fmt: skip
"""Okabe and Ito's colours for the colour-blind, then those of Tol's "muted" that differ most."""
NO_REGION = (0.80, 0.81, 0.83)
"""Points of no region, in [0, 1]."""
SEVERAL_REGIONS = (30, 30, 34)
"""Points of more than one region, 0 to 255."""
PALE = 0.55
"""Share of a region's colour, the rest white, where lines are drawn on the region."""
DEEP = 0.55
"""Share of a region's colour, the rest black, in the lines on it."""
AIR_MOVES = (0.52, 0.55, 0.62)
"""A tool's ways through the air."""
INSIDE = (0.58, 0.60, 0.63)
"""The back of an open mesh's triangles."""

COVERED, NOT_COVERED = (0.10, 0.62, 0.35), (0.84, 0.25, 0.15)
LEFT_OUT = (0.93, 0.70, 0.20)
"""Parts of a region that a simulated tool covers, should cover but does not, and leaves out."""
REACHED, NOT_REACHED = (0.10, 0.12, 0.20), (0.85, 0.10, 0.10)
"""Lines of a tool path that a robot reaches, and does not."""

_UNSURE, _HALF, _SURE = np.array([[215.0, 48.0, 39.0], [254.0, 224.0, 139.0], [26.0, 152.0, 80.0]])
_UNLIKE, _ALIKE = np.array([[49.0, 54.0, 149.0], [253.0, 231.0, 37.0]])


def region_colours(names: Sequence[str]) -> dict[str, np.ndarray]:
    """One colour (3,) in [0, 1] for each region name, in order; repeats after twelve."""
    values = [np.array(rgb(colour)) / 255 for colour in REGION_COLOURS]
    return {name: values[i % len(values)].copy() for i, name in enumerate(names)}


def next_region_colour(taken: Sequence[tuple[int, int, int]]) -> tuple[int, int, int]:
    """The first region colour, 0 to 255, that is not `taken`; repeats where all are."""
    colours = [rgb(colour) for colour in REGION_COLOURS]
    return next((c for c in colours if c not in taken), colours[len(taken) % len(colours)])


def confidence_scale(confidence: np.ndarray) -> np.ndarray:
    """Colours (k, 3) uint8 of confidences (k,): red 0, yellow 0.5, green 1."""
    share = np.clip(confidence, 0.0, 1.0)[:, None]
    low = _UNSURE + 2 * np.minimum(share, 0.5) * (_HALF - _UNSURE)
    colours = np.where(share <= 0.5, low, _HALF + (2 * share - 1) * (_SURE - _HALF))
    return colours.astype(np.uint8)


def similarity_scale(similarity: np.ndarray) -> np.ndarray:
    """Colours (k, 3) uint8 of similarities (k,) in [0, 1]: blue 0, yellow 1."""
    return (_UNLIKE + np.asarray(similarity)[:, None] * (_ALIKE - _UNLIKE)).astype(np.uint8)


def rgb(text: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of "#RRGGBB"."""
    return (int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16))
