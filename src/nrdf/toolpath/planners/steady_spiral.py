"""A spiral on a part like a disc: one line that steadily leaves its border.

The level line of "distance from the border less the share of a turn": both rise along it alike. The
share of a turn is the angle in the part's harmonic map to a disc.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_matrix

from nrdf.geometry.polylines import total_length
from nrdf.toolpath.planners.contour import rings_apart
from nrdf.toolpath.planners.distance import factor
from nrdf.toolpath.planners.field_lines import Part, even_levels
from nrdf.toolpath.planners.level_lines import MeshLine, level_lines
from nrdf.toolpath.strategy import Strategy

_TOP = 0.9  # of the largest distance from the border: the middle is among what is farther
_SEAM = 0.5  # of a turn: a triangle whose corners differ by more lies where turns are counted
_WHOLE = 0.3  # stepovers: a piece of a turn that is shorter is none


def steady_spiral(part: Part, strategy: Strategy) -> np.ndarray | None:
    """Points (n, 3), m, near the surface, from the border to the middle; None where the part is not
    like a disc, or its rings part."""
    border = _border(part)
    distance = part.border_distance
    if border is None or distance is None:
        return None
    stepover, margin = rings_apart(part, strategy), strategy.edge_margin_m
    most = float(distance.max())
    if most - margin < stepover:
        return None
    turn = _turns(part, border, distance)
    corner = turn[part.mesh.faces]
    middle = int(np.argmax(np.where(np.isnan(turn), np.inf, -np.inf)))
    kept = (np.ptp(corner, axis=1) < _SEAM) & ~(part.mesh.faces == middle).any(axis=1)
    inner = part.mesh.part(kept)
    used = np.unique(part.mesh.faces[kept])
    distance, turn = distance[used], turn[used]
    # A tool that reaches the border from a stepover inside needs no turn along it.
    around = strategy.tool_radius_m < stepover or margin > 0.0
    levels = even_levels(distance, inner.mass * (distance > margin), stepover)
    apart = float(levels[1] - levels[0]) if len(levels) > 1 else stepover
    start = float(levels[0]) if around else 0.0
    count = int(np.ceil((most - start) / apart))
    lines = level_lines(inner, distance - apart * turn, start + apart * np.arange(-1, count))
    pieces: list[np.ndarray] = []
    if around:
        ring = [_forward(line, turn) for line in level_lines(inner, distance, np.array([start]))]
        ring = [points for points in ring if total_length(points) > _WHOLE * stepover]
        if len(ring) != 1:
            return None
        pieces += ring
    for level in range(1, count + 1):
        here = [line for line in lines if line.level == level]
        here = [line for line in here if total_length(line.points) > _WHOLE * stepover]
        if len(here) > 1 or (not here and level < count - 1):
            return None
        pieces += [_forward(line, turn) for line in here]
    if len(pieces) > 1:  # the last is no whole turn: it may begin at either end, or lie aside
        last, place = pieces[-1], pieces[-2][-1]
        pieces.pop()
        away = np.linalg.norm(last[[0, -1]] - place, axis=1)
        if away.min() < stepover:
            pieces.append(last if away[0] <= away[1] else last[::-1])
    return np.concatenate(pieces) if pieces else None


def _border(part: Part) -> np.ndarray | None:
    """The border's vertices (b,) in order; None where the part is not like a disc."""
    loops, _ = part.mesh.border_loops()
    pairs, of_face = part.mesh.edges
    euler = len(part.mesh.vertices) - len(pairs) + len(part.mesh.faces)
    single = pairs[np.bincount(of_face.ravel(), minlength=len(pairs)) == 1]
    if len(loops) != 1 or euler != 1 or len(single) != len(np.unique(single)):
        return None
    after: dict[int, list[int]] = {}
    for a, b in single.tolist():
        after.setdefault(a, []).append(b)
        after.setdefault(b, []).append(a)
    order, last = [int(single[0, 0])], -1
    while len(order) < len(single):
        one, other = after[order[-1]]
        step = other if one == last else one
        last = order[-1]
        order.append(step)
    return np.array(order)


def _turns(part: Part, border: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Share (v,) of a turn about the part's middle, 0 to 1; NaN at the middle itself."""
    mesh = part.mesh
    places = mesh.vertices[border]
    along = np.cumsum(np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1))
    angle = 2.0 * np.pi * along / along[-1]
    plane = np.zeros((len(mesh.vertices), 2))
    plane[border] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    free = np.ones(len(plane), bool)
    free[border] = False
    stiffness = csc_matrix(mesh.stiffness)
    inner, right = stiffness[free][:, free], -(stiffness[free][:, ~free] @ plane[~free])
    solver = factor(csc_matrix(inner))
    plane[free] = np.stack([solver.solve(right[:, a]) for a in (0, 1)], axis=1)
    top = np.flatnonzero(distance > _TOP * distance.max())
    centre = np.average(plane[top], axis=0, weights=mesh.mass[top])
    middle = int(top[np.argmin(np.linalg.norm(plane[top] - centre, axis=1))])
    away = plane - plane[middle]
    turn = np.mod(np.arctan2(away[:, 1], away[:, 0]) / (2.0 * np.pi), 1.0)
    turn[middle] = np.nan
    return np.asarray(turn)


def _forward(line: MeshLine, turn: np.ndarray) -> np.ndarray:
    """A line's points (n, 3) in the sense in which turns are counted; a closed one from where they
    begin."""
    share = line.values(turn)
    return line.points if share[-1] >= share[0] else line.points[::-1]
