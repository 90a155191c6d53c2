"""What planners share: a region's parts in fine triangles, and level lines of them as paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.polylines import total_length
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.closed_border import ClosedBorder
from nrdf.toolpath.planners.distance import distance_from
from nrdf.toolpath.planners.level_lines import MeshLine, cut_where, level_lines, resampled
from nrdf.toolpath.planners.ordering import snake_order
from nrdf.toolpath.planners.origin import extent, levels_through, value_at
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_EDGE, _OPEN = 0.45, 0.3
SPECK = 0.5
"""Share of the footprint's area that a part must have to get a line."""
_LEAST_SPACING = 0.9
_SINGLE = 1.5  # radii: a part so wide is reached from its middle line
_PIECE, _NEXT_TO = 8.0, 0.6
"""Stepovers that a short piece is long, at most, and that it is from longer lines."""
SPIKE = 0.001
"""Share of a part's area: how far out its outermost tips do not count."""
_TAIL = 0.02  # of the area: what may lie beyond the reach of a single line


@dataclass(frozen=True)
class Part:
    """A part of a region that hangs together, in fine triangles; or a sheet of one.

    whole: the part that a sheet was cut from, and at: (v,) which of its vertices the sheet's are.
    slits: it is several flat pieces of one plane, and lines run over the slits between them.
    closed: the whole region's border where lines keep a margin from it; None where they keep none.
    """

    mesh: FineMesh
    whole: Part | None = None
    at: np.ndarray | None = None
    slits: bool = False
    closed: ClosedBorder | None = None

    def sheet(self, kept: np.ndarray) -> Part:
        """The triangles that are kept (f,) bool."""
        used = np.unique(self.mesh.faces[kept])
        return Part(self.mesh.part(kept), self, used, closed=self.closed)

    @cached_property
    def border_distance(self) -> np.ndarray | None:
        """Distance (v,) along the surface from the region's border, m; None where it has none."""
        if self.whole is not None:
            distance = self.whole.border_distance
            return distance if distance is None else distance[self.at]
        border = self.mesh.border
        return distance_from(self.mesh, border) if len(border) else None

    @cached_property
    def margin_distance(self) -> np.ndarray | None:
        """Distance (v,) from the border that a margin is kept from, m: at least that from the
        region's border, and more where that is ragged, or near others of the region."""
        if self.whole is not None:
            distance = self.whole.margin_distance
            return distance if distance is None else distance[self.at]
        distance = self.border_distance
        if distance is None or self.closed is None:
            return distance
        return np.maximum(distance, self.closed.distance(self.mesh.vertices))

    @cached_property
    def centre(self) -> np.ndarray:
        """Centre (3,) of its area, m."""
        return np.asarray(np.average(self.mesh.centres, axis=0, weights=self.mesh.areas))

    @cached_property
    def axes(self) -> np.ndarray:
        """Principal axes (3, 3), rows, the longest first."""
        away = self.mesh.centres - self.centre
        return np.asarray(np.linalg.eigh((away * self.mesh.areas[:, None]).T @ away)[1].T[::-1])

    @cached_property
    def outward(self) -> np.ndarray | None:
        """Mean normal (3,), unit; None where the part closes around itself."""
        mean = np.average(self.mesh.normals, axis=0, weights=self.mesh.areas)
        length = float(np.linalg.norm(mean))
        return mean / length if length > _OPEN else None

    def inside(self, lines: Sequence[MeshLine], margin_m: float) -> list[MeshLine]:
        """Lines as far as they keep a margin from the border."""
        distance = self.margin_distance if margin_m > 0.0 else None
        if distance is None:
            return list(lines)
        return [
            part for line in lines for part in cut_where(line, line.values(distance) - margin_m)
        ]


def parts_of(region: RegionMesh, strategy: Strategy, edge: float = _EDGE) -> list[Part]:
    """The parts of a region that are worth a line, the largest first, in triangles with edges of so
    many stepovers."""
    radius, margin = strategy.tool_radius_m, strategy.edge_margin_m > 0.0

    def made() -> list[Part]:
        meshes = refined(region, strategy, edge).components()
        least = SPECK * np.pi * radius**2
        chosen = [m for m in meshes if float(m.areas.sum()) >= least] or meshes[:1]
        closed = closed_border(region, strategy)
        return [Part(mesh, closed=closed) for mesh in chosen]

    return region.last(
        ("parts", region.rough), (_edge_m(region, strategy, edge), radius, margin), made
    )


def closed_border(region: RegionMesh, strategy: Strategy) -> ClosedBorder | None:
    """What lines keep the strategy's margin from; None where it has none."""
    if strategy.edge_margin_m <= 0.0:
        return None
    return ClosedBorder.of(region, strategy.tool_radius_m)


def refined(region: RegionMesh, strategy: Strategy, edge: float = _EDGE) -> FineMesh:
    """A region in triangles that are fine enough for the stepover, with edges of so many."""
    return refine(region.mesh.vertices, region.mesh.faces, _edge_m(region, strategy, edge))


def _edge_m(region: RegionMesh, strategy: Strategy, edge: float) -> float:
    """The longest edge of a region's triangles: so many stepovers or, for a first look, up to
    twice that."""
    longest = edge * strategy.stepover_m
    return float(2.0 ** np.ceil(np.log2(longest))) if region.rough else longest


def even_levels(
    values: np.ndarray,
    weights: np.ndarray,
    stepover_m: float,
    single_m: float = 0.0,
    more: int = 0,
    tail: float = SPIKE,
) -> np.ndarray:
    """Levels (k,) of a distance (n,) for lines one stepover apart, or up to a tenth less.

    The outermost lines are half a stepover from the ends at most. weights: (n,), areas. single_m:
    up to that width one line in the middle will do. more: lines that are added, closer together.
    tail: share of the area at either end that makes the part no wider.
    """
    low, high = extent(values, weights, tail)
    width = high - low
    most = float(np.ptp(extent(values, weights, _TAIL)))
    count = 1 if most <= single_m else max(int(np.ceil(width / stepover_m - 0.02)), 1)
    apart = max(width / count, _LEAST_SPACING * stepover_m)
    if more:
        count += more
        apart = width / count
    return 0.5 * (low + high) + apart * (np.arange(count) - 0.5 * (count - 1))


def driven(
    region: RegionMesh, part: Part, lines: Sequence[MeshLine], strategy: Strategy
) -> list[SurfacePath]:
    """Level lines as paths in snake order, their contacts evenly spaced on the region's triangles.

    Pieces shorter than the tool's radius are left out where longer lines are.
    """
    placed = [resampled(line, strategy.spacing_m) for line in lines]
    runs = _over_slits(lines, placed, strategy) if part.slits else [[k] for k in range(len(lines))]
    length = np.array([sum(total_length(lines[k].points) for k in run) for run in runs])
    least = min(strategy.tool_radius_m, float(length.max(initial=0.0)))
    kept = [run for run, way in zip(runs, length, strict=True) if way >= least > 0.0]
    if not kept:
        return []
    contacts = [np.concatenate([placed[k][0] for k in run]) for run in kept]
    faces = np.concatenate([placed[k][1] for run in kept for k in run])
    points, origin = np.concatenate(contacts), part.mesh.origin[faces]
    if any(line.closed for line in lines):
        on_mesh = region.mesh.nearest(points, region.mesh.face_normals[origin])
        points, origin = on_mesh.points, on_mesh.faces
    normals = region.mesh.smooth_normals(points, origin, strategy.tool_radius_m)
    cuts = np.cumsum([len(points) for points in contacts])[:-1]
    paths = [
        SurfacePath(placed_on, outward, lines[run[0]].closed)
        for run, placed_on, outward in zip(
            kept, np.split(points, cuts), np.split(normals, cuts), strict=True
        )
    ]
    return snake_order(paths, [lines[run[0]].level for run in kept], strategy.stepover_m)


def _over_slits(
    lines: Sequence[MeshLine], placed: list[tuple[np.ndarray, np.ndarray]], strategy: Strategy
) -> list[list[int]]:
    """Runs of lines of one level, one beyond the other, with slits between that the tool is driven
    over. Turns what was placed on them (n, 3), (n,) to run the same way."""
    ends = np.array([points[-1] - points[0] for points, _ in placed]).reshape(-1, 3)
    along = ends[int(np.argmax(np.linalg.norm(ends, axis=1)))] if len(ends) else np.zeros(3)
    for k, (points, faces) in enumerate(placed):
        if ends[k] @ along < 0.0:
            placed[k] = points[::-1], faces[::-1]
    runs: list[list[int]] = []
    order = sorted(range(len(lines)), key=lambda k: (lines[k].level, placed[k][0][0] @ along))
    for k in order:
        if runs and lines[runs[-1][-1]].level == lines[k].level:
            gap = placed[k][0][0] - placed[runs[-1][-1]][0][-1]
            if np.linalg.norm(gap) < min(0.5 * strategy.tool_radius_m, 1.5 * strategy.spacing_m):
                runs[-1].append(k)
                continue
        runs.append([k])
    return runs


def _needed(lines: list[MeshLine], strategy: Strategy) -> list[MeshLine]:
    """Lines without the short ones that run next to longer ones: ends of lines that meet."""
    if not lines:
        return lines
    length = np.array([total_length(line.points) for line in lines])
    short = length < min(_PIECE * strategy.stepover_m, 0.5 * float(length.max()))
    if not short.any() or short.all():
        return lines
    places = [resampled(line, 0.5 * strategy.stepover_m)[0] for line in lines]
    kept = np.flatnonzero(~short).tolist()
    tree = cKDTree(np.concatenate([places[k] for k in kept]))
    for k in sorted(np.flatnonzero(short).tolist(), key=lambda k: -length[k]):
        away = tree.query(places[k])[0]
        if (away > _NEXT_TO * strategy.stepover_m).mean() > 0.1:
            kept.append(k)
            tree = cKDTree(np.concatenate([places[j] for j in kept]))
    return [lines[k] for k in sorted(kept)]


def lines_at(
    part: Part, values: np.ndarray, strategy: Strategy, more: int = 0, tail: float = SPIKE
) -> list[MeshLine]:
    """Lines of a distance (v,) across a part, one stepover apart, inside the margin.

    more: lines that are added, closer together. tail: as `even_levels` has it. With an origin, a
    line passes through it, and the others are at whole stepovers from it.
    """
    weight, margin = part.mesh.mass, strategy.edge_margin_m
    if margin > 0.0 and part.margin_distance is not None:
        weight = weight * (part.margin_distance > margin)
    if not weight.any():
        return []
    levels = even_levels(
        values, weight, strategy.stepover_m, _SINGLE * strategy.tool_radius_m, more, tail
    )
    if strategy.origin_m is not None:
        apart = float(np.diff(levels).min()) if more else strategy.stepover_m
        through = value_at(part.mesh, values, strategy.origin_m)
        low, high = extent(values, weight, tail)
        levels = levels_through(through, low, high, apart, strategy.tool_radius_m)
    return _needed(part.inside(level_lines(part.mesh, values, levels), margin), strategy)


def checked(paths: list[SurfacePath], strategy: Strategy) -> list[SurfacePath]:
    """The paths. Raises ProcessError where there are none."""
    if not paths:
        raise ProcessError(
            f"edge_margin_m is {strategy.edge_margin_m:g}, which leaves nothing of the region; "
            "give less"
        )
    return paths
