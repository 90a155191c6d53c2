"""Where on its region a result is farthest off: places with names that a person finds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.process_model.result import Target

_MOST = 5
_APART = 0.15  # of the region's longest side, between places that are told
_PLACE, _SPECK = 0.03, 5e-4  # of the longest side: how wide a place is; of the area: what is none
_EDGE, _HEIGHTS = 0.12, (0.35, 0.65)  # share of a side that is its edge; the middle third


@dataclass(frozen=True)
class WorstPlace:
    """A place (3,), m, with what is there, m, and where that is, in words."""

    place: tuple[float, float, float]
    value_m: float
    where: str


def worst_places(
    centres: np.ndarray,
    areas_m2: np.ndarray,
    values_m: np.ndarray,
    target: Target,
    up: np.ndarray,
    forward: np.ndarray,
    count: int = _MOST,
) -> list[WorstPlace]:
    """The places farthest from a target, beyond its tolerance, some way apart from each other.

    centres: (n, 3), m; areas_m2, values_m: (n,). up, forward: (3,) of the object. Each place has
    the mean of the cells beside it that are off to the same side; specks are no places.
    """
    off = values_m - target.value_m
    size = float(np.ptp(centres, axis=0).max())
    left = np.abs(off) > target.tolerance_m
    found: list[WorstPlace] = []
    while left.any() and len(found) < count:
        worst = int(np.argmax(np.where(left, np.abs(off), -1.0)))
        away = np.linalg.norm(centres - centres[worst], axis=1)
        near = away < _APART * size
        same = (away < _PLACE * size) & left & (off * off[worst] > 0.0)
        area = float(areas_m2[same].sum())
        if area > _SPECK * float(areas_m2.sum()):
            x, y, z = centres[worst].tolist()
            where = place_in_words(centres[worst], centres, up, forward)
            found.append(
                WorstPlace((x, y, z), float(areas_m2[same] @ values_m[same]) / area, where)
            )
        left &= ~near
    return found


def place_in_words(
    place: np.ndarray, centres: np.ndarray, up: np.ndarray, forward: np.ndarray
) -> str:
    """Where a place (3,) is on a region of cells at `centres` (n, 3): "front, left, edge"."""
    right = np.cross(forward, up)
    words = []
    shares = []
    for axis, low_name, high_name in (
        (forward, "rear", "front"), (right, "left", "right"), (up, "bottom", "top"),
    ):  # fmt: skip
        along = centres @ axis
        low, high = float(along.min()), float(along.max())
        if high - low < 0.1 * float(np.ptp(centres, axis=0).max()):
            continue  # a region as thin as that has no two ends there
        share = (float(place @ axis) - low) / (high - low)
        shares.append(min(share, 1.0 - share))
        if share < _HEIGHTS[0]:
            words.append(low_name)
        elif share > _HEIGHTS[1]:
            words.append(high_name)
    words = words or ["middle"]
    return " ".join(words) + (", at the edge" if shares and min(shares) < _EDGE else "")
