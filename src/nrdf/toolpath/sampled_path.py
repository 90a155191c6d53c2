"""A tool path sampled densely: what its footprint covers, and how far its lines are apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.surface.border import OWN
from nrdf.surface.patch import Patch
from nrdf.toolpath.frames import travel_directions
from nrdf.toolpath.surface_path import SurfacePath

_FACING = 0.2
"""Least cosine between the tool's axis and the normal of a place that its footprint reaches."""
# Lines are beside each other where they run the same way or back, within 30 degrees, and the region
# goes on between them for certain: its border is known to about half the points' spacing.
_PARALLEL, _SURE, _LOOKS = np.cos(np.pi / 6), 0.5, 9
_NEXT_TO = 8  # points of which one is next to a place, on its side


@dataclass(frozen=True)
class SampledPath:
    """A tool path sampled densely.

    places: (n, 3) contacts; axes: (n, 3) tool z; travel: (n, 3), averaged over a distance to either
    side; arc_length: (n,), m, from the start, with a long step from line to line; step: m, between
    samples.
    """

    places: np.ndarray
    axes: np.ndarray
    travel: np.ndarray
    arc_length: np.ndarray
    step: float

    @staticmethod
    def along(
        contacts: list[np.ndarray], axes: list[np.ndarray], step: float, smooth: float
    ) -> SampledPath:
        """Samples of lines, `step` apart: contacts and axes (n, 3) of each line."""
        places, turned, travel, walked = [], [], [], []
        far = 0.0
        for line, axis in zip(contacts, axes, strict=True):
            way = arc_length(line)
            at = even_arc_lengths(float(way[-1]), step)
            fine = interpolate(at, way, line)
            places.append(fine)
            turned.append(interpolate(at, way, axis))
            travel.append(travel_directions(fine, smooth) if len(line) > 1 else np.zeros_like(fine))
            walked.append(far + at)
            far += way[-1] + 1e3
        place, axis, ahead, way = map(np.concatenate, (places, turned, travel, walked))
        return SampledPath(place, unit_vectors(axis), ahead, way, step)

    def coverage_count(self, points: np.ndarray, normals: np.ndarray, radius: float) -> np.ndarray:
        """How often (m,) the footprint passes over points (m, 3) with normals (m, 3)."""
        if not len(points):
            return np.zeros(0, int)
        point, place = _reached(points, normals, self.places, self.axes, radius)
        order = np.lexsort((place, point))
        point, way = point[order], self.arc_length[place[order]]
        new = np.ones(len(point), bool)
        new[1:] = (point[1:] != point[:-1]) | (np.diff(way) > 2.5 * self.step)
        return np.bincount(point[new], minlength=len(points))


def reached_points(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    axes: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Whether (m,) a footprint at places (n, 3), tool z at axes (n, 3), reaches points (m, 3)."""
    reached = np.zeros(len(points), bool)
    if len(places) and len(points):
        reached[_reached(points, normals, places, axes, radius)[0]] = True
    return reached


def _reached(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    axes: np.ndarray,
    radius: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (k,), (k,) of a point and a place from which the footprint reaches it."""
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(places), radius, output_type="ndarray")
    point, place = pairs["i"], pairs["j"]
    facing = -np.einsum("pa,pa->p", normals[point], axes[place]) > _FACING
    return point[facing], place[facing]


def sample_lines(lines: Sequence[SurfacePath], radius_m: float, stepover_m: float) -> SampledPath:
    """An upright tool of that radius along lines, sampled."""
    contacts, tools = [line.contacts for line in lines], [-line.normals for line in lines]
    return SampledPath.along(contacts, tools, radius_m / 4.0, 0.5 * stepover_m)


@dataclass(frozen=True)
class LineNeighbours:
    """Samples, by index (k,), places (k, 3) on the next lines beside them, and distances (k,), m,
    along the surface. patch: number (k,) of the patch that they were found in; middle:
    (k, 2), half-way between the two in its plane."""

    place: np.ndarray
    beside: np.ndarray
    distance: np.ndarray
    patch: np.ndarray
    middle: np.ndarray

    @staticmethod
    def none() -> LineNeighbours:
        nobody = np.zeros(0, int)
        return LineNeighbours(nobody, np.zeros((0, 3)), np.zeros(0), nobody, np.zeros((0, 2)))

    @staticmethod
    def joined(parts: Sequence[LineNeighbours]) -> LineNeighbours:
        names = [field.name for field in fields(LineNeighbours)]
        return LineNeighbours(
            *(np.concatenate([getattr(p, name) for p in parts]) for name in names)
        )


def line_spacing(patches: Sequence[Patch], sampled: SampledPath, stepover: float) -> LineNeighbours:
    """How far apart neighbouring lines are, along the surface.

    Square to the travel: the next line to either side counts if the region goes on all the way to
    it. What a place near a line's end would see aslant, past the end of the line beside it, is no
    neighbour; a break in that line shows what is beyond. Where another line comes nearer to the
    middle of the way than either (round a corner, past a short break), twice its distance from
    there counts: the width of the largest disc between lines. Neighbours are found in the patches'
    planes, and measured in space.
    """
    tails = -sampled.axes
    nearest: np.ndarray = np.full(len(tails), np.inf)
    owner: np.ndarray = np.zeros(len(tails), int)
    for number, patch in enumerate(patches):
        away = _placed(patch, sampled.places, tails, patch.label == OWN)[0]
        owner = np.where(away < nearest, number, owner)
        nearest = np.minimum(away, nearest)
    found = [LineNeighbours.none()]
    for number, patch in enumerate(patches):
        # Lines beyond a seam between patches are neighbours as well.
        _, point, uv = _placed(patch, sampled.places, tails, np.ones(len(patch.label), bool))
        off = np.linalg.norm(sampled.places - patch.points[point], axis=1)
        facing = np.einsum("na,na->n", patch.normals[point], tails)
        # A line over a few points on a face of their own is beside none.
        mine = np.flatnonzero(((owner == number) | (off < patch.spacing)) & (facing > _FACING))
        if len(mine):
            travel = np.einsum("nba,na->nb", patch.tangents[point[mine]], sampled.travel[mine])
            asking = owner[mine] == number
            near = _beside(patch, number, sampled, mine, uv[mine], travel, asking, stepover)
            found.append(near)
    return LineNeighbours.joined(found)


def _beside(
    patch: Patch,
    number: int,
    sampled: SampledPath,
    mine: np.ndarray,
    place: np.ndarray,
    travel: np.ndarray,
    asking: np.ndarray,
    stepover: float,
) -> LineNeighbours:
    """`line_spacing` in one patch, from those of its places that are `asking` (n,).

    number: the patch's. mine: (n,) of the samples; place, travel: (n, 2), in its plane.
    """
    reach, walked = 2.5 * stepover, sampled.arc_length[mine]
    tree = cKDTree(place)
    pairs = tree.sparse_distance_matrix(tree, reach + sampled.step, output_type="ndarray")
    i, j = pairs["i"], pairs["j"]
    going_on = np.append((np.diff(walked) < 2.0 * sampled.step) & (np.diff(mine) == 1), False)
    kept = going_on[j] & asking[i]
    i, j = i[kept], j[kept]
    # Where each step j of a line, to the place after it, crosses the square on the travel at i.
    one, other = place[j] - place[i], place[j + 1] - place[i]
    before, after = (np.einsum("pa,pa->p", way, travel[i]) for way in (one, other))
    share = before / np.where(before == after, np.inf, before - after)
    crossing = one + share[:, None] * (other - one)
    side = travel[i, 0] * crossing[:, 1] - travel[i, 1] * crossing[:, 0]
    away = np.linalg.norm(crossing, axis=1)
    kept = (before * after <= 0.0) & (before != after) & (away < reach)
    kept &= np.abs(walked[i] - walked[j]) > np.clip(3.0 * away, 2.0 * sampled.step, reach)
    i, j, share, crossing, away = (v[kept] for v in (i, j, share, crossing, away))
    key = 2 * i + (side[kept] > 0.0)
    order = np.lexsort((away, key))
    _, first = np.unique(key[order], return_index=True)
    i, j, share, crossing = (v[order][first] for v in (i, j, share, crossing))
    whole = (
        np.abs(np.einsum("pa,pa->p", unit_vectors(travel[i]), unit_vectors(travel[j]))) > _PARALLEL
    )
    for part in np.linspace(0.0, 1.0, _LOOKS + 2)[1:-1]:
        whole &= patch.border.distance(place[i] + part * crossing) > _SURE * patch.spacing
    i, j, share, crossing = i[whole], j[whole], share[whole, None], crossing[whole]
    line = sampled.places[mine[j]]
    beside = line + share * (sampled.places[mine[j + 1]] - line)
    chord = np.linalg.norm(beside - sampled.places[mine[i]], axis=1)
    turned = np.einsum("pa,pa->p", sampled.axes[mine[i]], sampled.axes[mine[j]])
    half = 0.5 * np.arccos(np.clip(turned, 0.0, 1.0))
    middle = place[i] + 0.5 * crossing
    nearest = tree.query(middle)[0] / np.maximum(np.linalg.norm(crossing, axis=1), 1e-12)
    arc = chord / np.sinc(half / np.pi)
    distance = arc * np.minimum(1.0, 2.0 * nearest)
    return LineNeighbours(mine[i], beside, distance, np.full(len(i), number), middle)


def _placed(
    patch: Patch, places: np.ndarray, tails: np.ndarray, among: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance (n,) of places (n, 3) from a patch, its point (n,) next to each, uv (n, 2) there.

    among: which of the patch's points count. tails: (n, 3), tells the side, that of the tool:
    distances are less the more a point faces it. On a thin part the nearest patch is the one that
    faces the tool, and next to an edge the nearest point is the one on the tool's face.
    """
    chosen = np.flatnonzero(among)
    count = np.arange(1, min(_NEXT_TO, len(chosen)) + 1)
    distance, near = cKDTree(patch.points[chosen]).query(places, count)
    near = chosen[near]
    distance -= 3.0 * patch.spacing * np.einsum("nka,na->nk", patch.normals[near], tails)
    best = np.arange(len(places)), distance.argmin(axis=1)
    distance, near = distance[best], near[best]
    offset = np.einsum("nba,na->nb", patch.tangents[near], places - patch.points[near])
    return distance, near, patch.uv[near] + offset
