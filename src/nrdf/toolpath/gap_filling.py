"""Gap filling: short lines over points that the others miss, and between lines too far apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.geometry.frames import tangent_frames, unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.surface.patch import Patch
from nrdf.surface.surface import Surface
from nrdf.toolpath.sampled_path import LineNeighbours, SampledPath, line_spacing, sample_lines
from nrdf.toolpath.surface_path import SurfacePath, find_contacts

_Guide = tuple[np.ndarray, np.ndarray]
"""Points (n, 3) near the surface, and the outward normals (n, 3) of its side there."""
_NEARBY, _NEAR, _FACE = 2.0, 4.0, 3
"""Units (the tool's radius, or the points' spacing where that is more) from a line: points farther
off than the first may not belong to the region, unless that many are a face of their own nearer
than the second."""
_ALIKE = 0.7  # cosine between the normals of places that one line may work
_WIDE = 1.12  # stepovers between lines that need another
_SHORTEST = 0.2  # spacings of waypoints
_NEXT = 1.5  # spacings between points that are next to each other
_ROUNDS = 3


def fill_missed_points(
    surface: Surface,
    wanted: np.ndarray,
    lines: Sequence[SurfacePath],
    spacing_m: float,
    radius_m: float,
    stepover_m: float,
) -> list[SurfacePath]:
    """Lines over those of the points `wanted` (k,) that a tool does not reach along `lines`.

    The border of a region is ragged, and at its corners a few points may stand alone on a face of
    their own. Points within two radii of a line, or three that are a face within four, share a
    line with those next to them, along their longest extent; where the points are farther apart
    than a radius, their spacing counts in its place. Points farther off stay as they are, and so do
    stripes between lines that are wanted farther apart than the tool is wide.
    """
    reach, unit_m = max(radius_m, 0.55 * stepover_m), max(radius_m, surface.spacing)
    made: list[SurfacePath] = []
    for _ in range(_ROUNDS):
        sampled = sample_lines([*lines, *made], radius_m, stepover_m)
        counts = sampled.coverage_count(surface.points[wanted], surface.normals[wanted], reach)
        left = wanted[counts == 0]
        away = cKDTree(sampled.places).query(surface.points[left])[0]
        left, away = left[away < _NEAR * unit_m], away[away < _NEAR * unit_m]
        nearby = set(left[away < _NEARBY * unit_m].tolist())
        groups = _groups(surface, left, max(radius_m, _NEXT * surface.spacing))
        groups = [g for g in groups if len(g) >= _FACE or not nearby.isdisjoint(g.tolist())]
        guides = [_along(surface, group, spacing_m) for group in groups]
        new = _lines(surface, guides, surface.spacing, radius_m)
        if not new:
            break
        made += new
    return made


def fill_wide_gaps(
    surface: Surface,
    patches: Sequence[Patch],
    lines: Sequence[SurfacePath],
    spacing_m: float,
    radius_m: float,
    stepover_m: float,
) -> list[SurfacePath]:
    """Lines half-way between those that are too far apart: beside breaks, and at patches' seams."""
    made: list[SurfacePath] = []
    if not lines:
        return made
    tried: list[np.ndarray] = []
    for _ in range(_ROUNDS):
        sampled = sample_lines([*lines, *made], radius_m, stepover_m)
        beside = line_spacing(patches, sampled, stepover_m)
        guides = _between(patches, sampled, beside, spacing_m, stepover_m, tried)
        new = _lines(surface, guides, max(surface.spacing, 0.5 * stepover_m), radius_m)
        if not new:
            break
        made += new
    return made


def _between(
    patches: Sequence[Patch],
    sampled: SampledPath,
    neighbours: LineNeighbours,
    spacing_m: float,
    stepover_m: float,
    tried: list[np.ndarray],
) -> list[_Guide]:
    """Guides through the middle of every gap that is too wide, apart from those `tried` before, to
    which they are added."""
    wide = np.flatnonzero(neighbours.distance > _WIDE * stepover_m)
    wide = wide[np.argsort(neighbours.place[wide], kind="stable")]
    middle, normal = _on_patches(patches, neighbours.patch[wide], neighbours.middle[wide])
    place = neighbours.place[wide]
    right = np.cross(sampled.travel[place], sampled.axes[place])
    side = np.einsum("na,na->n", right, neighbours.beside[wide] - sampled.places[place]) > 0.0
    guides: list[_Guide] = []
    for chosen in (np.flatnonzero(side), np.flatnonzero(~side)):
        ends = np.flatnonzero(np.diff(place[chosen]) > 2) + 1
        for run in np.split(chosen, ends):
            if not len(run):
                continue
            # Two lines see the gap between them, each from its side.
            if tried:
                seen = cKDTree(np.concatenate(tried)).query(middle[run])[0]
                if np.median(seen) < 0.25 * stepover_m:
                    continue
            at = place[run]
            longer = 0.5 * max(spacing_m - float(np.ptp(sampled.arc_length[at])), 0.0)
            first, last = (
                middle[run[[0, -1]]]
                + longer * np.array([[-1.0], [1.0]]) * sampled.travel[at[[0, -1]]]
            )
            turned = normal[run[[0, *range(len(run)), -1]]]
            whole = np.concatenate([first[None], middle[run], last[None]])
            along = arc_length(whole)
            at_even = even_arc_lengths(float(along[-1]), spacing_m, nearest=True)
            way = interpolate(at_even, along, whole)
            guides.append((way, unit_vectors(interpolate(at_even, along, turned))))
            tried.append(way)
    return guides


def _on_patches(
    patches: Sequence[Patch], patch: np.ndarray, uv: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) and normals (n, 3) at uv (n, 2) in the planes of the patches numbered (n,)."""
    places, normals = np.zeros((2, len(uv), 3))
    for number in np.unique(patch):
        here = patch == number
        places[here], along = patches[number].at(uv[here])
        normals[here] = unit_vectors(np.cross(along[:, 0], along[:, 1]))
    return places, normals


def _groups(surface: Surface, left: np.ndarray, near: float) -> list[np.ndarray]:
    """Points (k,) by those that face the same way and are next to each other."""
    if not len(left):
        return []
    points, normals = surface.points[left], surface.normals[left]
    next_to = cKDTree(points).sparse_distance_matrix(
        cKDTree(points), near, output_type="coo_matrix"
    )
    alike = np.einsum("ea,ea->e", normals[next_to.row], normals[next_to.col]) > _ALIKE
    next_to.data = alike.astype(float)
    next_to.eliminate_zeros()
    count, which = connected_components(next_to, directed=False)
    return [left[which == k] for k in range(count)]


def _along(surface: Surface, group: np.ndarray, spacing_m: float) -> _Guide:
    """A way along the longest extent of points (k,)."""
    points = surface.points[group]
    normal = unit_vectors(surface.normals[group].mean(axis=0))
    middle = points.mean(axis=0)
    offset = points - middle
    along = tangent_frames(normal[None])[0, 0]
    if len(group) > 1:
        along = np.linalg.svd(offset, full_matrices=False)[2][0]
        along = unit_vectors(along - along @ normal * normal)
    ahead = offset @ along
    half = 0.5 * max(_SHORTEST * spacing_m, float(np.ptp(ahead)))
    at = np.linspace(-half, half, max(int(np.rint(2.0 * half / spacing_m)), 1) + 1)
    way = middle + (0.5 * (ahead.min() + ahead.max()) + at[:, None]) * along
    return way, np.broadcast_to(normal, way.shape)


def _lines(
    surface: Surface, guides: Sequence[_Guide], near: float, radius_m: float
) -> list[SurfacePath]:
    """Guides brought onto the surface, those that have two waypoints there."""
    if not guides:
        return []
    places = np.concatenate([way for way, _ in guides])
    facing = np.concatenate([normals for _, normals in guides])
    contacts, normals, there = find_contacts(surface, places, facing, near, radius_m)
    cuts = np.cumsum([len(way) for way, _ in guides])[:-1]
    parts = zip(*(np.split(v, cuts) for v in (contacts, normals, there)), strict=True)
    return [SurfacePath(c[t], n[t]) for c, n, t in parts if t.sum() > 1]
