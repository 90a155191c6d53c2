"""Lines through points in even steps that keep their corners."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate

_CORNER = 0.15
"""Steps that a point is off the straight way from half a step before it to half a step after it:
on an arc, where its radius is less than 0.83 steps."""
_STRAIGHT = 0.15  # half steps that a side of a corner may bend, over two, which is then made sharp
_SIDES = np.array([-1.0, -2.0 / 3.0, -1.0 / 3.0, 1.0, 2.0 / 3.0, 1.0 / 3.0])


def corners_of(line: np.ndarray, step: float, closed: bool = False) -> np.ndarray:
    """Arc lengths (c,), ascending, of a line's (n, 3) corners: places at which steps of that length
    cut much off. At least half a step lies between them, and from the ends of what is not closed.
    """
    along = arc_length(line)
    total, half = float(along[-1]), 0.5 * step
    middle = 0.5 * sum(_places(line, along + way, closed) for way in (-half, half))
    off = np.linalg.norm(line - middle, axis=1)
    if not closed:
        off[(along < half) | (along > total - half)] = 0.0
    found = np.zeros(0)
    for k in np.argsort(-off, kind="stable"):
        if off[k] < _CORNER * step:
            break
        away = np.abs(found - along[k])
        if np.minimum(away, total - away if closed else np.inf).min(initial=np.inf) >= half:
            found = np.append(found, along[k])
    return np.sort(found)


def resample_with_corners(
    line: np.ndarray, spacing: float, closed: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, 3) of a line (n, 3) in steps as near to `spacing` as they can be, and the arc
    lengths (m,) that they stand for.

    Even steps would cut corners off: here they are among the points, where the straight ways before
    and after them meet, even if the line itself cuts them off a little. closed: the last point is
    the first; what has corners begins at one of them.
    """
    total, reach = float(arc_length(line)[-1]), 1.5 * spacing
    corners = corners_of(line, spacing, closed)
    fixed = np.concatenate([[0.0], corners, [total]])
    if closed and len(corners):
        fixed = np.append(corners, corners[0] + total)
    parts = [a + even_arc_lengths(b - a, spacing, nearest=True) for a, b in pairwise(fixed)]
    at = np.concatenate([part[:-1] for part in parts] + [fixed[-1:]])
    points = _places(line, at, closed)
    for corner in corners:
        if closed or reach <= corner <= total - reach:
            sides = _places(line, corner + reach * _SIDES, closed).reshape(2, 3, -1)
            away = np.abs(at - corner)
            here = np.minimum(away, np.abs(away - total)) < 1e-9 * total
            points[here] = _meeting(sides, points[here][0], 0.5 * spacing)
    return points, np.mod(at, total) if closed and len(corners) else at


def _places(line: np.ndarray, at: np.ndarray, closed: bool) -> np.ndarray:
    """Points (m, 3) of a line (n, 3) at arc lengths (m,), which go round a closed one again."""
    along = arc_length(line)
    round_ = closed and along[-1] > 0.0
    return interpolate(np.mod(at, along[-1]) if round_ else at, along, line)


def _meeting(sides: np.ndarray, corner: np.ndarray, half: float) -> np.ndarray:
    """Where two straight sides (2, 3, 3) of a corner (3,) meet, from their far ends on; the corner
    itself where they bend, or meet far from it."""
    way = sides[:, 2] - sides[:, 0]
    bend = np.linalg.norm(sides[:, 1] - 0.5 * (sides[:, 0] + sides[:, 2]), axis=1)
    if bend.max() > _STRAIGHT * half:
        return corner
    shares = np.linalg.lstsq(np.stack([way[0], -way[1]], axis=1), sides[1, 2] - sides[0, 2])[0]
    meeting = (sides[:, 2] + shares[:, None] * way).mean(axis=0)
    return np.asarray(meeting if np.linalg.norm(meeting - corner) < half else corner)
