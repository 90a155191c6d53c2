"""How well a tool path works its region: the figures of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from nrdf.errors import ProcessError
from nrdf.process.border import OWN
from nrdf.process.frames import lean_rotation, surface_frames, travel_of
from nrdf.process.patch import Patch, patches_of
from nrdf.process.plan import Strategy
from nrdf.process.surface import Surface, unit
from nrdf.process.toolpath import Segment

_FACING = 0.2
"""Least cosine between the tool's axis and the normal of a place that its footprint reaches."""


@dataclass(frozen=True)
class Measures:
    """Figures of one tool path on one region.

    coverage: share [0, 1] of the region's area inside its margin that the footprint reaches;
    overlap: share of what is reached that it reaches more than once in a pass;
    line_spacing_*: between neighbouring lines, along the surface; None where no line has a
    neighbour. surface_distance_*: of the process waypoints from the local smooth surface at the
    stand-off asked for, the worst and the 99th percentile; axis_error_99_rad: 99th percentile of
    the angle between the tool's axis and the one asked for. process_length_m: of the process
    segments; path_length_m: of all, free moves between them included; cycle_time_s: at the feeds
    given, dwells included.
    """

    coverage: float
    overlap: float
    line_spacing_mean_m: float | None
    line_spacing_worst_m: float | None
    surface_distance_worst_m: float
    surface_distance_99_m: float
    axis_error_99_rad: float
    path_length_m: float
    process_length_m: float
    cycle_time_s: float


def measure(
    surface: Surface, region: np.ndarray, strategy: Strategy, segments: Sequence[Segment]
) -> Measures:
    """Figures of `segments` on `region`, indices (k,) of the surface's points.

    The region's points, each of which stands for the same area, tell what is covered. Raises
    ProcessError if there is no process segment.
    """
    work = [segment for segment in segments if segment.kind == "process"]
    if not work:
        raise ProcessError("a tool path without a process segment cannot be measured")
    patches = patches_of(surface, region)
    axes = [_axes(segment) for segment in work]
    contacts = [
        s.positions + strategy.standoff_m * axis for s, axis in zip(work, axes, strict=True)
    ]
    once = len(work) // strategy.passes if len(work) % strategy.passes == 0 else len(work)
    track = _Track.along(contacts[:once], axes[:once], strategy.tool_radius_m / 4.0)
    inside = inside_margin(surface, region, patches, strategy.edge_margin_m)
    visits = track.visits(surface.points[inside], surface.normals[inside], strategy.tool_radius_m)
    spacing = _line_spacing(patches, track, strategy.stepover_m)
    off, wrong = _fit(surface, strategy, work, contacts)
    process, between, time = _driven(segments, strategy.approach_feed_m_s)
    return Measures(
        coverage=float((visits > 0).mean()) if len(visits) else 0.0,
        overlap=float((visits[visits > 0] > 1).mean()) if (visits > 0).any() else 0.0,
        line_spacing_mean_m=float(spacing.mean()) if len(spacing) else None,
        line_spacing_worst_m=float(spacing.max()) if len(spacing) else None,
        surface_distance_worst_m=float(off.max()),
        surface_distance_99_m=float(np.quantile(off, 0.99)),
        axis_error_99_rad=float(np.quantile(wrong, 0.99)),
        path_length_m=process + between,
        process_length_m=process,
        cycle_time_s=time,
    )


def _axes(segment: Segment) -> np.ndarray:
    """Tool z (n, 3) of a segment."""
    return Rotation.from_quat(segment.quaternions_xyzw).as_matrix()[:, :, 2]


def _fit(
    surface: Surface,
    strategy: Strategy,
    work: Sequence[Segment],
    contacts: Sequence[np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Of every waypoint, the distance (n,), m, from the smooth surface that faces the tool, and
    the angle (n,), rad, between tool z and what the strategy asks for on smooth normals."""
    everywhere = np.concatenate(contacts)
    held = Rotation.from_quat(np.concatenate([segment.quaternions_xyzw for segment in work]))
    lean = lean_rotation(strategy.lead_rad, strategy.tilt_rad)
    tails = -(held * lean.inv()).as_matrix()[:, :, 2]
    _, _, off = surface.nearest(everywhere, tails)
    off = np.minimum(off, surface.tree.query(everywhere)[0])  # the cloud, where it is no surface
    smooth = surface.smooth_normals(everywhere, tails, strategy.tool_radius_m)
    asked = []
    cuts = np.cumsum([len(line) for line in contacts])[:-1]
    for line, normals in zip(contacts, np.split(smooth, cuts), strict=True):
        # A waypoint alone has no travel; for a tool that does not lean, any will do.
        travel = travel_of(line, 0.5 * strategy.stepover_m) if len(line) > 1 else np.ones((1, 3))
        asked.append(surface_frames(travel, normals))
    axes = (Rotation.from_matrix(np.concatenate(asked)) * lean).as_matrix()[:, :, 2]
    cosine = np.einsum("na,na->n", axes, held.as_matrix()[:, :, 2])
    return off, np.arccos(np.clip(cosine, -1.0, 1.0))


def _driven(segments: Sequence[Segment], free_feed: float) -> tuple[float, float, float]:
    """Length of process segments, length of everything else, time of all."""
    process, between, time = 0.0, 0.0, 0.0
    end = None
    for segment in segments:
        if end is not None:
            free = float(np.linalg.norm(segment.positions[0] - end))
            between, time = between + free, time + free / free_feed
        length = float(np.linalg.norm(np.diff(segment.positions, axis=0), axis=1).sum())
        time += length / segment.feed_m_s + segment.dwell_s
        if segment.kind == "process":
            process += length
        else:
            between += length
        end = segment.positions[-1]
    return process, between, time


def inside_margin(
    surface: Surface, region: np.ndarray, patches: Sequence[Patch], margin: float
) -> np.ndarray:
    """Indices of the region's points that are not in the margin along its border."""
    inside = np.zeros(len(surface.points), bool)
    inside[surface.indices(region)] = True
    if margin > 0.0:
        for patch in patches:
            own = patch.label == OWN
            inside[patch.index[own]] = patch.border.distance(patch.uv[own]) >= margin
    return np.flatnonzero(inside)


def covered(
    points: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    axes: np.ndarray,
    radius: float,
) -> np.ndarray:
    """Whether (m,) a footprint at places (n, 3), tool z at axes (n, 3), reaches points (m, 3)."""
    reached = np.zeros(len(points), bool)
    if len(places) and len(points):
        pairs = cKDTree(points).sparse_distance_matrix(
            cKDTree(places), radius, output_type="ndarray"
        )
        facing = -np.einsum("pa,pa->p", normals[pairs["i"]], axes[pairs["j"]]) > _FACING
        reached[pairs["i"][facing]] = True
    return reached


@dataclass(frozen=True)
class _Track:
    """A tool's way, sampled densely: places (n, 3), tool z (n, 3), travel (n, 3); walked (n,), m,
    from the start, with a long step from line to line."""

    places: np.ndarray
    axes: np.ndarray
    travel: np.ndarray
    walked: np.ndarray
    step: float

    @staticmethod
    def along(contacts: list[np.ndarray], axes: list[np.ndarray], step: float) -> _Track:
        places, turned, travel, walked = [], [], [], []
        far = 0.0
        for line, axis in zip(contacts, axes, strict=True):
            way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
            at = np.linspace(0.0, way[-1], max(int(np.ceil(way[-1] / step)), 1) + 1)
            fine = np.stack([np.interp(at, way, line[:, k]) for k in range(3)], axis=1)
            places.append(fine)
            turned.append(np.stack([np.interp(at, way, axis[:, k]) for k in range(3)], axis=1))
            travel.append(travel_of(fine) if len(line) > 1 else np.zeros_like(fine))
            walked.append(far + at)
            far += way[-1] + 1e3
        place, axis, ahead, way = map(np.concatenate, (places, turned, travel, walked))
        return _Track(place, unit(axis), ahead, way, step)

    def visits(self, points: np.ndarray, normals: np.ndarray, radius: float) -> np.ndarray:
        """How often (m,) the footprint passes over points (m, 3) with normals (m, 3)."""
        if not len(points):
            return np.zeros(0, int)
        pairs = cKDTree(points).sparse_distance_matrix(
            cKDTree(self.places), radius, output_type="ndarray"
        )
        point, place = pairs["i"], pairs["j"]
        facing = -np.einsum("pa,pa->p", normals[point], self.axes[place]) > _FACING
        point, place = point[facing], place[facing]
        order = np.lexsort((place, point))
        point, way = point[order], self.walked[place[order]]
        new = np.ones(len(point), bool)
        new[1:] = (point[1:] != point[:-1]) | (np.diff(way) > 2.5 * self.step)
        return np.bincount(point[new], minlength=len(points))


def _line_spacing(patches: Sequence[Patch], track: _Track, stepover: float) -> np.ndarray:
    """Distances (k,), m, along the surface, from places of lines to the next lines beside them.

    The nearest line to either side counts if the region goes on all the way to it, within one
    patch. Neighbours are found in the patch's plane, and measured in space.
    """
    owner, point, uv = locate(patches, track.places, -track.axes)
    found = [np.zeros(0)]
    for number, patch in enumerate(patches):
        mine = np.flatnonzero(owner == number)
        if not len(mine):
            continue
        place, walked = uv[mine], track.walked[mine]
        travel = np.einsum("nba,na->nb", patch.tangents[point[mine]], track.travel[mine])
        gap = np.abs(np.diff(walked, prepend=-np.inf, append=np.inf)) > 2.0 * track.step
        end = gap[1:] | gap[:-1]
        tree = cKDTree(place)
        pairs = tree.sparse_distance_matrix(tree, 2.5 * stepover, output_type="ndarray")
        i, j, away = pairs["i"], pairs["j"], pairs["v"]
        offset = place[j] - place[i]
        beside = travel[i, 0] * offset[:, 1] - travel[i, 1] * offset[:, 0]
        other = np.abs(walked[i] - walked[j]) > np.minimum(3.0 * away, 2.5 * stepover)
        kept = other & (np.abs(beside) > 0.5 * away) & (away > 1e-9)
        i, j, key = i[kept], j[kept], (2 * i + (beside > 0.0))[kept]
        chord = np.linalg.norm(track.places[mine[j]] - track.places[mine[i]], axis=1)
        order = np.lexsort((chord, key))
        _, first = np.unique(key[order], return_index=True)
        i, j, chord = (values[order][first] for values in (i, j, chord))
        # What goes on past a line's end is not beside it, and what is far off no neighbour.
        whole = ~end[j] & (chord < 2.5 * stepover)
        for share in (0.25, 0.5, 0.75):
            whole &= patch.border.distance((1.0 - share) * place[i] + share * place[j]) > 0.0
        i, j, chord = i[whole], j[whole], chord[whole]
        turned = np.einsum("pa,pa->p", track.axes[mine[i]], track.axes[mine[j]])
        half = 0.5 * np.arccos(np.clip(turned, 0.0, 1.0))
        found.append(chord / np.sinc(half / np.pi))  # the arc over the chord
    return np.concatenate(found)


def locate(
    patches: Sequence[Patch], places: np.ndarray, tails: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The patch (n,) that each of `places` (n, 3) is on, the patch's point (n,) nearest to it, and
    its uv (n, 2) there; tails: (n, 3) tells the side, that of the tool."""
    best = np.full(len(places), np.inf)
    owner, point = np.zeros(len(best), int), np.zeros(len(best), int)
    uv = np.zeros((len(best), 2))
    for number, patch in enumerate(patches):
        own = np.flatnonzero(patch.label == OWN)
        distance, near = cKDTree(patch.points[own]).query(places)
        near = own[near]
        # On a thin part the nearest patch is the one that faces the tool.
        distance -= 3.0 * patch.spacing * np.einsum("na,na->n", patch.normals[near], tails)
        offset = np.einsum("nba,na->nb", patch.tangents[near], places - patch.points[near])
        closer = distance < best
        best, owner = np.where(closer, distance, best), np.where(closer, number, owner)
        point = np.where(closer, near, point)
        uv = np.where(closer[:, None], patch.uv[near] + offset, uv)
    return owner, point, uv
