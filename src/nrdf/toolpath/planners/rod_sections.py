"""Sections of a rod, square to its axis: where its surface is, around it, at every station."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, interpolate, resample, step_lengths, total_length
from nrdf.surface.fine_mesh import FineMesh
from nrdf.toolpath.planners.level_lines import MeshLine, level_lines
from nrdf.toolpath.planners.reeb_graph import crossings

_STEP = 0.25  # of a thickness, between points of an axis
_BEYOND = 2.5  # thicknesses that an axis goes on beyond its ends
_ROUNDS = 3  # in which the nearest place on the axis is found
_STRAIGHTENED, _CALM = 3, 4  # rounds in which an axis is found, and points over which it is calm
_SLANTED = 0.5  # thicknesses from its ends, where sections may be cut
_USUAL = 0.6  # of the usual section's length: sections that are shorter say nothing of the axis
_SEAM = 0.1  # of the thickness: pieces of a section that are closer meet


@dataclass(frozen=True)
class RodFrame:
    """A rod's axis with directions that turn with it, as little as they can.

    points: (n, 3), m, at even steps; along, right, up: (n, 3) unit directions; reach: (n,) arc
    length, m.
    """

    points: np.ndarray
    along: np.ndarray
    right: np.ndarray
    up: np.ndarray
    reach: np.ndarray

    @staticmethod
    def of(points: np.ndarray, thickness_m: float) -> RodFrame:
        """The frame of an axis (n, 3), whose ends go on straight."""
        even = resample(points, min(_STEP * thickness_m, 0.2 * total_length(points)))
        near = min(8, len(even) - 1)
        first = unit_vectors((even[0] - even[near])[None])[0]
        last = unit_vectors((even[-1] - even[-1 - near])[None])[0]
        reach = _BEYOND * thickness_m
        apart = even[-1] - even[0]
        if first @ apart > 0.0:  # a ring: each end goes half the way to the other
            reach = min(reach, 0.5 * float(np.linalg.norm(apart)))
        beyond = reach * np.array([1.0, 0.5])[:, None]
        even = np.concatenate([even[0] + beyond * first, even, even[-1] + beyond[::-1] * last])
        even = resample(even, _STEP * thickness_m)
        along = unit_vectors(gaussian_filter1d(np.gradient(even, axis=0), 1.0, axis=0))
        right = np.empty_like(even)
        side = np.eye(3)[int(np.argmin(np.abs(along[0])))]
        for k, ahead in enumerate(along):
            side = side - (side @ ahead) * ahead
            side = side / np.linalg.norm(side)
            right[k] = side
        return RodFrame(even, along, right, np.cross(along, right), arc_length(even))

    def station(self, places: np.ndarray) -> np.ndarray:
        """Arc length (m,), m, of the axis at which planes square to it pass through places."""
        at = self.reach[cKDTree(self.points).query(places)[1]]
        for _ in range(_ROUNDS):
            ahead = places - interpolate(at, self.reach, self.points)
            along = unit_vectors(interpolate(at, self.reach, self.along))
            at = np.clip(at + np.einsum("ma,ma->m", ahead, along), self.reach[0], self.reach[-1])
        return np.asarray(at)

    def at(self, stations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (s, 3) of the axis, and axes (s, 3, 3): rows right, up, along."""
        rows = [
            unit_vectors(interpolate(stations, self.reach, way))
            for way in (self.right, self.up, self.along)
        ]
        return interpolate(stations, self.reach, self.points), np.stack(rows, axis=1)


@dataclass(frozen=True)
class Section:
    """What a plane square to the axis cuts of a rod, counterclockwise about the axis.

    points: (n, 3), m, the last one the first; flat: (n, 2) the same in the frame, m; faces:
    (n - 1,) triangle of each step, -1 where the way leads through the air; along: (n,) arc length,
    m.
    """

    points: np.ndarray
    flat: np.ndarray
    faces: np.ndarray
    along: np.ndarray

    @property
    def length_m(self) -> float:
        """Length of the way around, m, gaps included."""
        return float(self.along[-1])

    @property
    def gap_m(self) -> float:
        """Of that, through the air."""
        return float(np.diff(self.along)[self.faces < 0].sum())


def untorn(mesh: FineMesh, frame: RodFrame, thickness_m: float) -> FineMesh:
    """A rod's triangles without those between its two ends, where it closes to a ring."""
    kept = _kept(mesh, frame.station(mesh.vertices), thickness_m)
    return mesh if kept.all() else mesh.part(kept)


def _kept(mesh: FineMesh, at: np.ndarray, thickness_m: float) -> np.ndarray:
    """The triangles (f,) that are not between the two ends of a ring; at: (v,) stations, m."""
    kept = np.ptp(at[mesh.faces], axis=1) < max(2.0 * thickness_m, 2.0 * mesh.edge_m)
    return kept if kept.any() else np.ones(len(kept), bool)


def straightened(mesh: FineMesh, points: np.ndarray, thickness_m: float) -> RodFrame:
    """The frame whose axis (n, 3) runs through the middles of the sections square to it."""
    frame = RodFrame.of(points, thickness_m)
    for _ in range(_STRAIGHTENED):
        at = frame.station(mesh.vertices)
        # Where a ring's two ends meet moves with its axis.
        kept = _kept(mesh, at, thickness_m)
        low, high = float(at.min()), float(at.max())
        step = max(_STEP * thickness_m, 0.5 * mesh.edge_m)
        count = max(int((high - low) / step), 8)
        levels = low + (high - low) * (np.arange(count) + 0.5) / count
        middle, around = _middles(mesh, at, levels, kept)
        good = around > _USUAL * float(np.median(around))
        end = min(_SLANTED * thickness_m, 0.25 * (high - low))
        good &= (levels > low + end) & (levels < high - end)
        if good.sum() < 4:
            return frame
        place, _ = frame.at(levels[good])
        off = middle[good] - place
        # Straight at the ends, where caps and slanted cuts draw the middle aside.
        pad = min(2 * _CALM, len(off) - 1)
        smooth = np.concatenate(
            [2 * off[0] - off[pad:0:-1], off, 2 * off[-1] - off[-2 : -2 - pad : -1]]
        )
        off = gaussian_filter1d(smooth, _CALM, axis=0)[pad : len(off) + pad]
        frame = RodFrame.of(place + off, thickness_m)
    return frame


def _middles(
    mesh: FineMesh, values: np.ndarray, levels: np.ndarray, kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Middles (s, 3) of lines at levels (s,), evenly rising, of values (v,), on the triangles that
    are kept (f,); lengths (s,), m."""
    step = levels[1] - levels[0]
    corner = (values[mesh.faces] - levels[0]) / step
    first = np.maximum(np.ceil(corner.min(axis=1)).astype(int), 0)
    count = np.floor(corner.max(axis=1)).astype(int).clip(max=len(levels) - 1) - first + 1
    count = np.where(kept, np.maximum(count, 0), 0)
    face = np.repeat(np.arange(len(mesh.faces)), count)
    level = np.arange(len(face)) - np.repeat(np.cumsum(count) - count, count) + first[face]
    one, other, crossed = crossings(mesh, values, face, levels[level])
    length = np.where(crossed, np.linalg.norm(other - one, axis=1), 0.0)
    around = np.bincount(level, length, minlength=len(levels))
    middle = [
        np.bincount(level, length * 0.5 * (one + other)[:, a], minlength=len(levels))
        for a in range(3)
    ]
    return np.stack(middle, axis=1) / np.maximum(around, 1e-300)[:, None], around


def sections(mesh: FineMesh, frame: RodFrame, stations: np.ndarray) -> list[Section | None]:
    """The section at each station; None where there is no surface."""
    lines: list[list[MeshLine]] = [[] for _ in stations]
    for line in level_lines(mesh, frame.station(mesh.vertices), stations):
        lines[line.level].append(line)
    places, axes = frame.at(stations)
    return [
        _section(mesh, here, place, rows) if here else None
        for here, place, rows in zip(lines, places, axes, strict=True)
    ]


def _section(
    mesh: FineMesh, lines: list[MeshLine], place: np.ndarray, rows: np.ndarray
) -> Section | None:
    """Pieces in the order of their angle, with straight ways between."""
    pieces = []
    rings = [line for line in lines if line.closed]
    ring = max(rings, key=lambda line: total_length(line.points), default=None)
    total = sum(total_length(line.points) for line in lines if not line.closed)
    if ring is not None and total_length(ring.points) > total:
        lines, total = [ring], total_length(ring.points)
    for line in lines:
        points, faces = line.points, line.faces[:-1]
        step = np.diff(points, axis=0)
        # Counterclockwise is along x outward.
        ahead = np.cross(rows[2], mesh.normals[faces])
        if float(np.einsum("na,na->", step, ahead)) < 0.0:
            points, faces = points[::-1], faces[::-1]
        flat = (points - place) @ rows[:2].T
        if not line.closed or line is ring:
            pieces.append((points, flat, faces))
    if not pieces:
        return None
    pieces.sort(key=lambda piece: float(np.arctan2(*piece[1][len(piece[1]) // 2][::-1])))
    points = np.concatenate([piece[0] for piece in pieces])
    flat = np.concatenate([piece[1] for piece in pieces])
    faces = np.concatenate([np.append(piece[2], -1) for piece in pieces])
    # Seams are no gaps.
    closing = step_lengths(np.concatenate([points, points[:1]]))
    seam = (faces < 0) & (closing < _SEAM * total / np.pi)
    faces[seam] = np.roll(faces, 1)[seam]
    points, flat = np.concatenate([points, points[:1]]), np.concatenate([flat, flat[:1]])
    return Section(points, flat, faces, arc_length(points))


def lengths_at(section: Section, shares: np.ndarray, closed: bool) -> np.ndarray:
    """Arc lengths (k,) of shares of a section. A closed one starts where it passes the frame's
    right, farthest out; an open one after its widest gap."""
    if closed:
        x, y = section.flat[:, 0], section.flat[:, 1]
        up = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
        start = 0.0
        if len(up):
            way = -y[up] / np.maximum(y[up + 1] - y[up], 1e-300)
            out = x[up] + way * (x[up + 1] - x[up])
            k = int(np.argmax(out))
            start = float(
                section.along[up[k]] + way[k] * (section.along[up[k] + 1] - section.along[up[k]])
            )
        return start + shares * section.length_m
    step = np.diff(section.along)
    gap = int(np.argmax(np.where(section.faces < 0, step, -1.0)))
    start = float(section.along[gap + 1])
    return start + shares * (section.length_m - float(step[gap]))


def at_shares(section: Section, shares: np.ndarray, closed: bool) -> np.ndarray:
    """Places (k, 2) in the frame at shares of a section; NaN in its gaps."""
    at = lengths_at(section, shares, closed) % section.length_m
    step = np.clip(np.searchsorted(section.along, at, side="right") - 1, 0, len(section.faces) - 1)
    flat = np.stack([np.interp(at, section.along, section.flat[:, a]) for a in (0, 1)], axis=1)
    flat[section.faces[step] < 0] = np.nan
    return flat


def nearest_on_section(
    section: Section, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nearest places (k, 3) of a section to places (k, 2) in the frame, their triangles (k,),
    and how far they are, m."""
    on = np.flatnonzero(section.faces >= 0)
    start, ahead = section.flat[on], section.flat[on + 1] - section.flat[on]
    square = np.maximum((ahead**2).sum(axis=1), 1e-300)
    share = np.einsum("kna,na->kn", wanted[:, None] - start[None], ahead) / square
    share = np.clip(share, 0.0, 1.0)
    away = np.linalg.norm(wanted[:, None] - (start + share[..., None] * ahead), axis=2)
    best = away.argmin(axis=1)
    row = np.arange(len(wanted))
    one, other = section.points[on[best]], section.points[on[best] + 1]
    places = one + share[row, best, None] * (other - one)
    return places, section.faces[on[best]], away[row, best]
