"""The rods of a part, and the strokes along each, evenly around its section.

A part is split into rods at its branches and sharp bends (`rod_skeleton`). Each flat side of a
section has its own strokes, in its middle where it is narrow; a round section has them all around.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import step_lengths, total_length
from nrdf.surface.fine_mesh import FineMesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part
from nrdf.toolpath.planners.ordering import snake_order
from nrdf.toolpath.planners.reeb_graph import touching_faces
from nrdf.toolpath.planners.rod_sections import (
    RodFrame,
    Section,
    at_shares,
    lengths_at,
    nearest_on_section,
    sections,
    straightened,
    untorn,
)
from nrdf.toolpath.planners.rod_skeleton import split_at_branches
from nrdf.toolpath.planners.sheets import pieces_of
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_SLENDER, _SLENDER_STRIP, _WHOLE = 1.5, 3.0, 0.7
"""A rod is that many times as long as its section is around, or as a strip is wide, and its
sections account for that share of its surface."""
_EVEN, _EVEN_WIDE, _WIDE = 1.8, 1.3, 12.0
"""Times as long as a short section is a long one, at most: else it is a cone; or a panel, where
its sections are that many stepovers long."""
_NO_ROD = 0.4  # of a part's area that is in no rod: then none of it is worked as one
_LEAST = 8.0  # triangles' edges, squared: a rod has more surface
_OPEN = 0.4  # of a section: where more is missing, it is a strip with two edges
_STRAIGHT = 2.0  # thicknesses: sections that differ over less don't lead strokes aside
_STEP = 2.0  # spacings: a longer step lifts the tool
_SHARES = 120  # places around a section at which its sides are told apart
_CORNER, _NEAR = 0.7, 0.04  # cosine of a turn within twice that share of a section: a corner
_MOST_APART, _LEAST_APART, _LEAST_SIDE = 1.14, 0.95, 0.15
"""Stepovers: between strokes of one side, and the narrowest side that has a stroke."""
_SINGLE = 1.5  # tool radii: so wide a side is reached from its middle
_LOOKS, _AROUND = float(np.radians(110.0)), 4
"""What a tool that looks one way reaches of a turn, and strokes that a round section needs."""
_AWAY = 0.4  # stepovers from where a stroke should be: there is no surface
_PART = 0.8  # of the usual section's length: what is shorter is cut at an end
_REST = 0.2  # of a part's area that is in no rod


@dataclass(frozen=True)
class Rod:
    """A piece of a part that is long and thin. mesh: its triangles; frame: its axis; stations: (s,)
    along it, m, with the section at each; around_m: the usual length of a section."""

    mesh: FineMesh
    frame: RodFrame
    stations: np.ndarray
    sections: list[Section | None]
    around_m: float

    @cached_property
    def closed(self) -> bool:
        """Whether it closes around itself, but for gaps; else it is a strip."""
        gaps = [s.gap_m / s.length_m for s in self.sections if s is not None]
        return float(np.median(gaps)) < _OPEN


def rods_of(part: Part, strategy: Strategy) -> tuple[list[Rod], list[Part]]:
    """A part split at its branches into rods, with a section every spacing, and what is none.

    All of it is "none" where it is no rod.
    """
    touching = touching_faces(part.mesh)
    axes, number = split_at_branches(part.mesh, touching, _LEAST * part.mesh.edge_m**2)
    rods, rest = [], number < 0
    for k, axis in enumerate(axes):
        piece = part.mesh.part(number == k) if (number == k).any() else None
        rod = None if piece is None else _rod(piece, axis.points, axis.thickness_m, strategy)
        if rod is None:
            rest |= number == k
        else:
            rods.append(rod)
    if float(part.mesh.areas[rest].sum()) > _NO_ROD * float(part.mesh.areas.sum()):
        rods, rest = [], np.ones(len(rest), bool)
    return rods, pieces_of(part, rest)


def rod_strokes(region: RegionMesh, part: Part, strategy: Strategy) -> list[SurfacePath]:
    """The strokes of a part that is rods, and nothing else; none of any other."""
    rods, rest = rods_of(part, strategy)
    left = sum(float(piece.mesh.areas.sum()) for piece in rest)
    if left > _REST * float(part.mesh.areas.sum()):
        return []
    return [path for rod in rods for path in strokes_of(region, part, rod, strategy)]


def strokes_of(region: RegionMesh, part: Part, rod: Rod, strategy: Strategy) -> list[SurfacePath]:
    """The strokes of one rod in snake order, side by side."""
    there = [k for k, section in enumerate(rod.sections) if section is not None]
    usual = [s for s in rod.sections if s is not None]
    shares, sides = _stroke_shares(rod, usual, strategy)
    wanted = np.stack([at_shares(section, shares, rod.closed) for section in usual])
    thick = rod.around_m / np.pi / strategy.spacing_m  # stations
    around = np.array([[[s.length_m - s.gap_m]] for s in usual])
    size = _smooth(around, thick)
    wanted[around[:, 0, 0] < _PART * size[:, 0, 0]] = np.nan
    wanted = size * _smooth(wanted / size, _STRAIGHT * thick)
    places = np.zeros((len(usual), len(shares), 3))
    faces = np.zeros((len(usual), len(shares)), int)
    good = np.zeros((len(usual), len(shares)), bool)
    for s, section in enumerate(usual):
        places[s], faces[s], away = nearest_on_section(section, wanted[s])
        good[s] = away < _AWAY * strategy.stepover_m
    if strategy.edge_margin_m > 0.0 and len(part.mesh.border):
        nearest = cKDTree(part.mesh.vertices[part.mesh.border])
        finite = places[good]  # where there is no surface, places are not finite
        away = nearest.query(finite)[0]
        if part.closed is not None:
            away = np.maximum(away, part.closed.distance(finite))
        good[good] = away > strategy.edge_margin_m
    origin = rod.mesh.origin[faces]
    axes = rod.frame.at(rod.stations[there])[1]
    paths, numbers = [], []
    for k in range(len(shares)):
        on = np.flatnonzero(good[:, k])
        far = step_lengths(places[on, k]) > _STEP * strategy.spacing_m
        far |= np.diff(np.array(there)[on]) > 2
        for run in np.split(on, np.flatnonzero(far) + 1):
            if len(run) > 1 and total_length(places[run, k]) >= strategy.tool_radius_m:
                normals = region.mesh.smooth_normals(
                    places[run, k], origin[run, k], strategy.tool_radius_m
                )
                rows = axes[run]
                steady = _smooth(np.einsum("sra,sa->sr", rows, normals)[:, None], thick)[:, 0]
                normals = unit_vectors(np.einsum("sra,sr->sa", rows, steady))
                paths.append(SurfacePath(places[run, k], normals))
                numbers.append(k + 2 * int(sides[k]))  # strokes of two sides are no neighbours
    return snake_order(paths, numbers, strategy.stepover_m)


def _rod(mesh: FineMesh, points: np.ndarray, thickness_m: float, strategy: Strategy) -> Rod | None:
    """The rod about an axis (n, 3); None where it is not slender, or mostly something else."""
    frame = straightened(mesh, points, thickness_m)
    mesh = untorn(mesh, frame, thickness_m)
    at = frame.station(mesh.vertices)
    low, high = float(at.min()), float(at.max())
    length = high - low
    count = max(int(np.ceil(length / strategy.spacing_m)), 2)
    stations = low + length * (np.arange(count) + 0.5) / count
    found = sections(mesh, frame, stations)
    around = np.array([0.0 if s is None else s.length_m - s.gap_m for s in found])
    usual = float(np.median(around))
    if usual <= 0.0 or length < _SLENDER * usual:
        return None
    short, long = np.quantile(around, [0.2, 0.8])
    wide = usual > _WIDE * strategy.stepover_m
    if long > (_EVEN_WIDE if wide else _EVEN) * short:
        return None
    if around.sum() * length / count < _WHOLE * float(mesh.areas.sum()):
        return None
    rod = Rod(mesh, frame, stations, found, usual)
    return rod if rod.closed or length >= _SLENDER_STRIP * usual else None


def _stroke_shares(
    rod: Rod, usual: Sequence[Section], strategy: Strategy
) -> tuple[np.ndarray, np.ndarray]:
    """Shares (k,) of a section at which strokes run, and the side (k,) that each is on.

    As many on a side as its width needs, and as it turns: a tool looks one way.
    """
    around = [s.length_m if rod.closed else s.length_m - s.gap_m for s in usual]
    length, typical = np.quantile(around, [0.8, 0.5])
    normals = _mean_normals(rod, usual)
    corners = _corners(rod, normals)
    if not rod.closed:
        corners = np.unique(np.concatenate([[0.0], corners, [1.0]]))
    elif not len(corners):
        number = max(int(np.ceil(length / strategy.stepover_m / _MOST_APART)), _AROUND)
        return np.arange(number) / number, np.zeros(number, int)
    else:
        corners = np.append(corners, corners[0] + 1.0)
    shares, sides = [], []
    for side, (first, last) in enumerate(pairwise(corners)):
        width = (last - first) * length / strategy.stepover_m
        if width < _LEAST_SIDE and len(corners) > 2 and length > strategy.stepover_m:
            continue
        single = width * strategy.stepover_m <= _SINGLE * strategy.tool_radius_m
        number = 1 if single else int(np.ceil(width / _MOST_APART))
        at, angle = _turning(normals, first, last)
        looks = int(np.ceil((angle[-1] - angle[0]) / _LOOKS)) if len(angle) else 0
        if looks > 1 and looks >= number:
            number = looks
            way = (np.arange(number) + 0.5) / number
            shares.append(np.interp(angle[0] + way * (angle[-1] - angle[0]), angle, at))
        else:
            apart = max(width / number, _LEAST_APART) * strategy.stepover_m / typical
            apart = min(apart, (last - first) / number) if number > 2 else apart
            middle = 0.5 * (first + last)
            shares.append(middle + apart * (np.arange(number) - 0.5 * (number - 1)))
        sides.append(np.full(number, side))
    return np.concatenate(shares), np.concatenate(sides)


def _mean_normals(rod: Rod, usual: Sequence[Section]) -> np.ndarray:
    """The mean normal (_SHARES, 2) at places around a section, 0 in gaps."""
    shares = (np.arange(_SHARES) + 0.5) / _SHARES
    mean = np.zeros((_SHARES, 2))
    for section in usual:
        at = lengths_at(section, shares, rod.closed)
        step = np.searchsorted(section.along, at % section.length_m, side="right") - 1
        step = np.clip(step, 0, len(section.faces) - 1)
        ahead = np.diff(section.flat, axis=0)[step]
        normal = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        mean += normal * (section.faces[step] >= 0)[:, None]
    return np.asarray(mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300))


def _turning(normals: np.ndarray, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
    """Shares (n,) between two corners, and how far the side has turned there (n,), rad, never
    back."""
    place = np.arange(round((first + _NEAR) * _SHARES), round((last - _NEAR) * _SHARES))
    place = place[normals[place % _SHARES].any(axis=1)]
    normal = normals[place % _SHARES]
    angle = np.unwrap(np.arctan2(normal[:, 1], normal[:, 0]))
    return (place + 0.5) / _SHARES, np.maximum.accumulate(angle)


def _corners(rod: Rod, mean: np.ndarray) -> np.ndarray:
    """Shares (c,) of a section at which its mean normals turn sharply."""
    reach = max(round(_NEAR * _SHARES), 1)
    if rod.closed:
        cosine = (np.roll(mean, reach, axis=0) * np.roll(mean, 1 - reach, axis=0)).sum(axis=1)
    else:
        cosine = np.ones(_SHARES)
        cosine[reach : _SHARES - reach + 1] = (
            mean[: _SHARES - 2 * reach + 1] * mean[2 * reach - 1 :]
        ).sum(axis=1)
    found = []
    cosine = cosine.copy()
    while cosine.min() < _CORNER:
        # The middle of the plateau in which the corner is seen.
        k = int(np.argmin(cosine))
        run = [k]
        for way in (1, -1):
            j = k + way
            while abs(j - k) <= 2 * reach and cosine[j % _SHARES] < cosine[k] + 0.1:
                run.append(j)
                j += way
        middle = 0.5 * (min(run) + max(run))
        found.append((middle / _SHARES) % 1.0)
        span = np.arange(min(run) - reach, max(run) + reach + 1) % _SHARES
        cosine[span] = 1.0
    return np.sort(np.array(found))


def _smooth(wanted: np.ndarray, thick: float) -> np.ndarray:
    """Values (s, k, a) without kinks over `thick` stations; gaps (NaN) are filled along the rod."""
    count = len(wanted)
    rows = np.arange(count)
    filled = wanted.copy()
    for k in range(wanted.shape[1]):
        good = np.isfinite(wanted[:, k, 0])
        for a in range(wanted.shape[2]):
            if good.any():
                filled[:, k, a] = np.interp(rows, rows[good], wanted[good, k, a])
            else:
                filled[:, k, a] = np.inf
    size = min(2 * int(max(thick, 2.0)) + 1, 2 * (count // 2) + 1)
    middle = median_filter(filled, (size, 1, 1), mode="nearest")
    return np.asarray(
        gaussian_filter1d(middle, max(0.5 * thick, 1.0), axis=0, mode="nearest", truncate=2.5)
    )
