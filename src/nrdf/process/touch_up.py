"""Short lines where a region's others leave something out: points, or a gap between two of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.process.lines import Line, touching
from nrdf.process.patch import Patch
from nrdf.process.surface import Surface, tangent_frames, unit
from nrdf.process.track import line_spacing, track_of

_NEARBY = 2.0  # radii from a line; what is farther off may not belong to the region
_ALIKE = 0.7  # cosine between the normals of places that one line may work
_WIDE = 1.12  # stepovers between lines that need another
_ROUNDS = 3


def touch_up(
    surface: Surface,
    wanted: np.ndarray,
    lines: Sequence[Line],
    spacing_m: float,
    radius_m: float,
    stepover_m: float,
) -> list[Line]:
    """Lines over those of the points `wanted` (k,) that a tool does not reach along `lines`.

    The border of a region is ragged, and at its corners a few points may stand alone on a face of
    their own. Points within two radii of a line that are next to each other share a line, along
    their longest extent. Points farther off stay as they are, and so do stripes between lines that
    are wanted farther apart than the tool is wide.
    """
    reach = max(radius_m, 0.55 * stepover_m)
    made: list[Line] = []
    for _ in range(_ROUNDS):
        track = track_of([*lines, *made], radius_m, stepover_m)
        visits = track.visits(surface.points[wanted], surface.normals[wanted], reach)
        left = wanted[visits == 0]
        near = cKDTree(track.places).query(surface.points[left])[0] < _NEARBY * radius_m
        found = [
            _line(surface, group, spacing_m, radius_m)
            for group in _groups(surface, left[near], radius_m)
        ]
        new = [line for line in found if line is not None]
        if not new:
            break
        made += new
    return made


def fill_gaps(
    surface: Surface,
    patches: Sequence[Patch],
    lines: Sequence[Line],
    spacing_m: float,
    radius_m: float,
    stepover_m: float,
) -> list[Line]:
    """Lines half-way between those that are too far apart: beside breaks, and at patches' seams."""
    made: list[Line] = []
    if not lines:
        return made
    for _ in range(_ROUNDS):
        track = track_of([*lines, *made], radius_m, stepover_m)
        found = line_spacing(patches, track, stepover_m)
        wide = np.flatnonzero(found.distance > _WIDE * stepover_m)
        wide = wide[np.argsort(found.place[wide], kind="stable")]
        side = np.einsum(
            "na,na->n",
            np.cross(track.travel[found.place[wide]], track.axes[found.place[wide]]),
            found.beside[wide] - track.places[found.place[wide]],
        )
        new: list[Line] = []
        for one in (side > 0.0, side <= 0.0):
            chosen = wide[one]
            ends = np.flatnonzero(np.diff(found.place[chosen]) > 2) + 1
            for run in np.split(chosen, ends):
                at = found.place[run]
                middle = 0.5 * (track.places[at] + found.beside[run])
                # Two lines see the gap between them, each from its side.
                done = np.concatenate([np.zeros((0, 3)), *(line.contacts for line in new)])
                seen = cKDTree(done).query(middle)[0] < 0.4 * stepover_m if len(done) else None
                if not len(run) or (seen is not None and seen.mean() > 0.5):
                    continue
                along = unit(track.travel[at[[0, -1]]])
                reach = 0.5 * max(spacing_m - float(np.ptp(track.walked[at])), 0.0)
                ends_m = middle[[0, -1]] + reach * np.array([[-1.0], [1.0]]) * along
                places = _resampled(np.concatenate([ends_m[:1], middle, ends_m[1:]]), spacing_m)
                facing = np.broadcast_to(-unit(track.axes[at].mean(axis=0)), places.shape)
                near = max(surface.spacing, 0.5 * stepover_m)
                contacts, normals, there = touching(surface, places, facing, near, radius_m)
                if there.sum() > 1:
                    new.append(Line(contacts[there], normals[there]))
        if not new:
            break
        made += new
    return made


def _resampled(way: np.ndarray, spacing_m: float) -> np.ndarray:
    """Places (m, 3) evenly along a way (n, 3)."""
    walked = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    at = np.linspace(0.0, walked[-1], max(int(np.rint(walked[-1] / spacing_m)), 1) + 1)
    return np.stack([np.interp(at, walked, way[:, k]) for k in range(3)], axis=1)


def _groups(surface: Surface, left: np.ndarray, radius_m: float) -> list[np.ndarray]:
    """Points (k,) by those that face the same way and are next to each other."""
    if not len(left):
        return []
    points, normals = surface.points[left], surface.normals[left]
    next_to = cKDTree(points).sparse_distance_matrix(
        cKDTree(points), radius_m, output_type="coo_matrix"
    )
    alike = np.einsum("ea,ea->e", normals[next_to.row], normals[next_to.col]) > _ALIKE
    next_to.data = alike.astype(float)
    next_to.eliminate_zeros()
    count, which = connected_components(next_to, directed=False)
    return [left[which == k] for k in range(count)]


def _line(surface: Surface, group: np.ndarray, spacing_m: float, radius_m: float) -> Line | None:
    """A line along the longest extent of points (k,); None where there is no surface for it."""
    points = surface.points[group]
    normal = unit(surface.normals[group].mean(axis=0))
    middle = points.mean(axis=0)
    offset = points - middle
    along = tangent_frames(normal[None])[0, 0]
    if len(group) > 1:
        along = np.linalg.svd(offset, full_matrices=False)[2][0]
        along = unit(along - along @ normal * normal)
    ahead = offset @ along
    half = max(0.5 * spacing_m, 0.5 * float(np.ptp(ahead)))
    at = np.linspace(-half, half, max(int(np.rint(2.0 * half / spacing_m)), 1) + 1)
    places = middle + 0.5 * (ahead.min() + ahead.max()) * along + at[:, None] * along
    facing = np.broadcast_to(normal, places.shape)
    contacts, normals, there = touching(surface, places, facing, surface.spacing, radius_m)
    return Line(contacts[there], normals[there]) if there.sum() > 1 else None
