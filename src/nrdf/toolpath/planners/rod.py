"""Rod: few long strokes along a leg or a rail, evenly around its section."""

from __future__ import annotations

import numpy as np

from nrdf.geometry.polylines import arc_length, interpolate, step_lengths, total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import distance_from
from nrdf.toolpath.planners.field_lines import Part, checked, driven, parts_of
from nrdf.toolpath.planners.level_lines import MeshLine, level_lines
from nrdf.toolpath.planners.ordering import snake_order
from nrdf.toolpath.planners.sheet_lines import sheet_lines
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_SLENDER, _WHOLE = 1.2, 0.8
"""A rod is that many times as long as its section is around, and at that share of its stations one
section holds most of the surface."""
_STEP = 2.0  # spacings: a longer step lifts the tool
_GAP = 0.5  # of the section's length: a section that is open wider is a strip's
_END = 0.6  # of the usual section's length: sections of the end caps are shorter


def plan_rod(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Strokes from end to end of every rod-like part; other parts get a raster.

    The section of a part is cut into as many even shares as stepovers fit around it, at every
    station along it: strokes follow bends and tapers, closer together where the rod is thinner.
    Raises ProcessError for a margin that leaves nothing.
    """
    found: list[SurfacePath] = []
    for part in parts_of(region, strategy):
        strokes = rod_strokes(region, part, strategy)
        found += strokes or driven(region, part, sheet_lines(region, part, strategy), strategy)
    return checked(found, strategy)


def rod_strokes(region: RegionMesh, part: Part, strategy: Strategy) -> list[SurfacePath]:
    """The strokes of one part in snake order; none where it is no rod."""
    along = _along(part)
    length = float(np.ptp(along))
    count = max(int(np.ceil(length / strategy.spacing_m)), 2)
    levels = along.min() + length * (np.arange(count) + 0.5) / count
    stations = _stations(level_lines(part.mesh, along, levels), count)
    around = np.array([total_length(line.points) for line in stations])
    gaps = [float(np.linalg.norm(line.points[-1] - line.points[0])) for line in stations]
    if len(stations) < _WHOLE * count or length < _SLENDER * float(np.median(around)):
        return []
    if np.median(gaps) > _GAP * np.median(around):
        return []
    if around.sum() * length / count < _WHOLE * float(part.mesh.areas.sum()):
        return []  # it has branches
    full = np.flatnonzero(around > _END * np.median(around))
    stations = stations[full[0] : full[-1] + 1]
    number = max(int(np.ceil(float(np.quantile(around, 0.9)) / strategy.stepover_m - 0.1)), 1)
    places, faces, there = _around(stations, number)
    faces = part.mesh.origin[faces]
    if strategy.edge_margin_m > 0.0 and part.border_distance is not None:
        nearest = part.mesh.vertices[part.mesh.border]
        away = np.linalg.norm(places[:, :, None] - nearest, axis=-1).min(axis=-1)
        there &= away > strategy.edge_margin_m
    paths, numbers = [], []
    for k in range(number):
        good = np.flatnonzero(there[:, k])
        far = step_lengths(places[good, k]) > _STEP * strategy.spacing_m
        for run in np.split(good, np.flatnonzero((np.diff(good) > 1) | far) + 1):
            if len(run) > 1 and total_length(places[run, k]) >= strategy.tool_radius_m:
                normals = region.mesh.smooth_normals(
                    places[run, k], faces[run, k], strategy.tool_radius_m
                )
                paths.append(SurfacePath(places[run, k], normals))
                numbers.append(k)
    return snake_order(paths, numbers, strategy.stepover_m)


def _along(part: Part) -> np.ndarray:
    """A length (v,) along a part, m: the distances from its two ends, each far from its own end,
    where its level lines run straight around the section."""
    middle = (part.mesh.vertices - part.centre) @ part.axes[0]
    away = distance_from(part.mesh, np.array([int(np.argmin(middle))]))
    thick = float(part.mesh.areas.sum() / away.max()) / np.pi
    from_last = distance_from(part.mesh, np.flatnonzero(away > away.max() - thick))
    at_first = from_last > from_last.max() - thick
    from_first = distance_from(part.mesh, np.flatnonzero(at_first))
    share = from_first / np.maximum(from_first + from_last, 1e-300)
    length = float(np.median((from_first + from_last)[(share > 0.3) & (share < 0.7)]))
    return np.asarray(share * from_first + (1.0 - share) * (length - from_last))


def _stations(lines: list[MeshLine], count: int) -> list[MeshLine]:
    """The section at each station, in order, where one line is most of what is there."""
    found = []
    for level in range(count):
        here = [line for line in lines if line.level == level]
        length = [total_length(line.points) for line in here]
        if here and max(length) > _WHOLE * sum(length):
            found.append(here[int(np.argmax(length))])
    return found


def _around(stations: list[MeshLine], number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (s, k, 3) at even shares of every section, triangles (s, k), and which there are.

    An open section counts as closed by a straight line, on which there are no places.
    """
    shape = (len(stations), number)
    places, faces, there = np.zeros((*shape, 3)), np.zeros(shape, int), np.zeros(shape, bool)
    start: np.ndarray | None = None
    travel = np.zeros(3)
    for s, line in enumerate(stations):
        points, on = line.points, line.faces
        if not line.closed:
            points, on = np.vstack([points, points[:1]]), np.append(on, -1)
            on[-2] = -1
        first = 0
        if start is not None:
            first = int(np.argmin(np.linalg.norm(points[:-1] - start, axis=1)))
        points = np.vstack([np.roll(points[:-1], -first, axis=0), points[first : first + 1]])
        on = np.roll(on[:-1], -first)
        way = arc_length(points)
        ahead = interpolate(np.array([0.1 * way[-1]]), way, points)[0] - points[0]
        if start is not None and ahead @ travel < 0.0:
            points, on = points[::-1], on[::-1]
            way = arc_length(points)
            ahead = interpolate(np.array([0.1 * way[-1]]), way, points)[0] - points[0]
        offset = 0.0
        if start is not None:
            # The start is where the one before is nearest, between points as well.
            step = _unit(ahead)
            offset = float((start - points[0]) @ step)
        at = (offset + way[-1] * np.arange(number) / number) % way[-1]
        places[s] = interpolate(at, way, points)
        step_of = np.clip(np.searchsorted(way, at, side="right") - 1, 0, len(way) - 2)
        faces[s], there[s] = on[step_of], on[step_of] >= 0
        start, travel = interpolate(np.array([offset % way[-1]]), way, points)[0], ahead
    return places, np.maximum(faces, 0), there


def _unit(vector: np.ndarray) -> np.ndarray:
    """A vector (3,) of length 1, or 0 where it has none."""
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-300))
