"""How far a row's neighbours are, on both sides of each of its places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate, total_length
from nrdf.toolpath.frames import travel_directions
from nrdf.toolpath.strategy import Strategy

ALIKE = 0.5  # cosine between normals of one side
_PARALLEL = 0.8  # cosine between the travel of neighbouring rows
_BESIDE, _SAME = 2.2, 0.2  # stepovers: the farthest neighbour, and the nearest that is another row
_AHEAD = 0.25  # stepovers: a neighbour that begins so far ahead or behind is beside
_LOOKS = (0.2, 0.35, 0.5, 0.65, 0.8)  # of the way between rows, where surface must be
_PARTS = 8  # samples a tool radius
_TURN, _WITHIN, _LINK = float(np.cos(np.radians(30.0))), 0.3, 1.6
"""What turns by more than that angle within that many stepovers ends a row; what is left between
two ends and shorter than that many stepovers leads from row to row."""
_EVEN, _NARROW = 1.15, 0.85  # stepovers
_RUN = 2.0  # stepovers: closer rows count where they run that far along each other
_FEW = 0.02  # of all places: where fewer have a neighbour, there are no rows to judge
_NEXT = 12  # samples of which one is next to a place, on its side

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Whether (m,) there is surface to be worked at places (m, 3), facing as (m, 3)."""


@dataclass(frozen=True)
class Line:
    """A stroke at even steps: points, outward normals and travel (n, 3), m."""

    points: np.ndarray
    normals: np.ndarray
    travel: np.ndarray

    @classmethod
    def of(cls, contacts: np.ndarray, axes: np.ndarray, strategy: Strategy) -> Line:
        """From contacts and tool axes (n, 3)."""
        along = arc_length(contacts)
        at = even_arc_lengths(float(along[-1]), strategy.tool_radius_m / _PARTS)
        points = interpolate(at, along, contacts)
        normals = -unit_vectors(interpolate(at, along, axes))
        return cls(points, normals, travel_directions(points))

    def rows(self, stepover_m: float) -> np.ndarray:
        """The number (n,) of the row that each place is of; -1 on the way from row to row."""
        points, count = self.points, len(self.points)
        whole = total_length(points)
        if whole < _LINK * stepover_m:
            return np.zeros(count, int)
        reach = max(round(_WITHIN * stepover_m * (count - 1) / whole), 1)
        here = np.arange(count)
        before, after = np.maximum(here - reach, 0), np.minimum(here + reach, count - 1)
        back, ahead = unit_vectors(points - points[before]), unit_vectors(points[after] - points)
        turning = np.einsum("na,na->n", back, ahead) < _TURN
        turning[[0, -1]] = False  # no way leads to the first place, and none from the last
        number = np.cumsum(turning | np.roll(turning, 1)) - 1
        _, number = np.unique(np.where(turning, -1 - here, number), return_inverse=True)
        long = np.bincount(number.reshape(-1)) * whole / (count - 1) >= _LINK * stepover_m
        return np.where(long[number.reshape(-1)], number.reshape(-1), -1)


def line_spacing(lines: Sequence[Line], stepover_m: float, surface: Surface) -> np.ndarray:
    """Distances (m,), m, along the surface to the next row on each side that has one.

    A row is a part of a stroke without a sharp turn; short ways that lead from row to row, as those
    of a zigzag along the border, are none. A row is a neighbour where it is parallel, on the same
    side of the part, and abreast, with surface all the way to it: what a hole, a slit or a wall
    parts are no neighbours. A chord's arc is told from the normals at its ends. Where something
    else of the path lies between, twice its distance from the middle counts, the width of the
    largest disc between them; and nothing, where that is no gap. Rows that are closer than 0.85
    stepovers count where they run along each other for two stepovers: lines of two sheets that meet
    at an angle are no neighbours. None are where fewer than 2 % of all places have one.
    """
    points = np.concatenate([line.points for line in lines])
    normals = np.concatenate([line.normals for line in lines])
    travel = np.concatenate([line.travel for line in lines])
    rows, first = [], 0
    for line in lines:
        own = line.rows(stepover_m)
        rows.append(np.where(own < 0, -1, own + first))
        first += len(own)
    row = np.concatenate(rows)
    in_row = np.flatnonzero(row >= 0)
    asked = in_row[::2]
    if not len(asked):
        return np.zeros(0)
    tree = cKDTree(points[in_row])
    here, there, apart, sides = [], [], [], []
    for i, near in zip(
        asked, tree.query_ball_point(points[asked], _BESIDE * stepover_m), strict=True
    ):
        k = in_row[near]
        offset = points[k] - points[i]
        cosine = normals[k] @ normals[i]
        ahead = offset @ travel[i]
        chosen = (np.abs(ahead) < _AHEAD * stepover_m) & (cosine > ALIKE)
        chosen &= np.abs(travel[k] @ travel[i]) > _PARALLEL
        bend = np.arccos(np.clip(cosine, -1.0, 1.0))
        across = np.linalg.norm(offset - ahead[:, None] * travel[i], axis=1)
        length = across / np.maximum(np.sinc(bend / (2.0 * np.pi)), 0.1)
        side = offset @ np.cross(normals[i], travel[i])
        for way in (1, -1):
            found = np.flatnonzero(chosen & (way * side > _SAME * stepover_m))
            if len(found):
                nearest = found[int(np.argmin(length[found]))]
                here.append(i)
                there.append(k[nearest])
                apart.append(float(length[nearest]))
                sides.append(way)
    if len(here) < _FEW * len(asked):
        return np.zeros(0)
    one, other, away, sense = map(np.array, (here, there, apart, sides))
    kept = _surface_between(points, normals, one, other, surface)
    one, other, away, sense = one[kept], other[kept], away[kept], sense[kept]
    away = _widths(points, normals, one, other, away, stepover_m)
    pair = sense * (row[one] * len(points) + row[other] + 1)
    _, which, run = np.unique(pair, return_inverse=True, return_counts=True)
    step = 2.0 * np.median(np.linalg.norm(np.diff(points[: len(lines[0].points)], axis=0), axis=1))
    briefly = run[which.reshape(-1)] * step < _RUN * stepover_m
    kept = np.isfinite(away) & ~(briefly & (away < _NARROW * stepover_m))
    return np.asarray(away[kept])


def _surface_between(
    points: np.ndarray, normals: np.ndarray, one: np.ndarray, other: np.ndarray, surface: Surface
) -> np.ndarray:
    """Whether (m,) there is surface all the way from places `one` (m,) to `other` (m,)."""
    whole = np.ones(len(one), bool)
    for share in _LOOKS:
        left = np.flatnonzero(whole)
        if not len(left):
            break
        a, b = one[left], other[left]
        facing = unit_vectors((1.0 - share) * normals[a] + share * normals[b])
        whole[left] = surface((1.0 - share) * points[a] + share * points[b], facing)
    return whole


def _widths(
    points: np.ndarray,
    normals: np.ndarray,
    one: np.ndarray,
    other: np.ndarray,
    away: np.ndarray,
    stepover_m: float,
) -> np.ndarray:
    """Distances (m,), the wide ones those that are free of the path in between; infinite where that
    is no gap."""
    wide = np.flatnonzero(away > _EVEN * stepover_m)
    if not len(wide):
        return away
    a, b = points[one[wide]], points[other[wide]]
    near, k = cKDTree(points).query(0.5 * (a + b), np.arange(1, min(_NEXT, len(points)) + 1))
    facing = unit_vectors(normals[one[wide]] + normals[other[wide]])
    alike = np.einsum("mka,ma->mk", normals[k], facing) > ALIKE
    nearest = np.where(alike, near, np.inf).min(axis=1)
    chord = np.maximum(np.linalg.norm(a - b, axis=1), 1e-12)
    disc = away[wide] * np.minimum(2.0 * nearest / chord, 1.0)
    away = away.copy()
    away[wide] = np.where(disc > _EVEN * stepover_m, disc, np.inf)
    return away
