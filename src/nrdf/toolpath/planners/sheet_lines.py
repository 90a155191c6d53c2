"""Lines of one sheet: even along the surface, straight over wide ones and along narrow ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.sparse import csc_matrix
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import total_length
from nrdf.surface.fine_mesh import FineMesh
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.distance import (
    distance_across,
    even_field,
    even_share,
    factor,
    signed_distance,
)
from nrdf.toolpath.planners.field_lines import SPIKE, Part, lines_at
from nrdf.toolpath.planners.flat_sheets import main_direction
from nrdf.toolpath.planners.level_lines import MeshLine
from nrdf.toolpath.planners.reach import reached_from_lines, reached_from_paths
from nrdf.toolpath.planners.sheets import Ends, band_borders, ends_of, is_band, width
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

LEAST_IN_SURFACE = 0.2
"""A direction with a smaller share of its length along a region gives no direction there."""
_WHOLE, _BETTER = 0.9, 1.2
# Lines mostly shorter than that share of a part may run across what should be followed: the other
# way is taken where its lines are that much longer.
_STRIP = 4.0  # times as long as wide: lines of such a sheet may follow it
_NARROW = 2.0  # stepovers: a narrower strip is followed, whatever the direction
_ROUNDS = 6
_TAIL = 0.03  # of a strip's area, on either side, that makes it no wider
_SPREAD, _ENDS = 1.6, 0.3  # of a strip's width and of its length: how far its ends reach
_WIDE, _MORE = 6.0, 2  # stepovers: only narrower sheets get that many more lines
_REACHED, _GAIN = 0.985, 0.01  # shares of a sheet's area
_SIDEWAYS = 0.6  # cosine
_STEEP, _ALL = 0.005, 0.995  # what a height's slope lacks of 1 on a plane, and where it may not


def sheet_lines(
    region: RegionMesh, part: Part, strategy: Strategy, beside: Sequence[SurfacePath] = ()
) -> list[MeshLine]:
    """The lines of one sheet, one stepover apart.

    A wide one has lines at even distances from a middle line in the strategy's direction, a long
    one lines along it around its bends, a closed band lines around it. A narrow one that turns over
    so far that the tool does not reach its sides has more, unless paths beside it reach those.
    Raises ProcessError for a direction that stands on the sheet.
    """
    if part.slits:
        along = line_direction(part, strategy.direction)
        height = height_over_middle(part, across_directions(part, along)[0])
        return lines_at(part, height, strategy)
    values, lines = _best_field(part, strategy)
    wide = float(np.ptp(values)) > _WIDE * strategy.stepover_m
    if wide or not lines or not _turns_over(part):
        return lines
    near = reached_from_paths(part, beside, strategy.tool_radius_m)

    def share(of_lines: Sequence[MeshLine]) -> float:
        reached = near | reached_from_lines(region, part, of_lines, strategy)
        return float(part.mesh.areas[reached].sum() / part.mesh.areas.sum())

    most = share(lines)
    for more in range(1, _MORE + 1):
        if most > _REACHED:
            break
        closer = lines_at(part, values, strategy, more)
        now = share(closer)
        if now > most + _GAIN:
            lines, most = closer, now
    return lines


def _turns_over(part: Part) -> bool:
    """Whether some of a part looks another way than a tool on its middle reaches."""
    if part.outward is None:
        return True
    beyond = part.mesh.normals @ part.outward < _SIDEWAYS
    return float(part.mesh.areas[beyond].sum()) > (1.0 - _REACHED) * float(part.mesh.areas.sum())


def _best_field(part: Part, strategy: Strategy) -> tuple[np.ndarray, list[MeshLine]]:
    """A distance (v,) across a part, m, and its lines: those that are longest and most even."""
    mesh = part.mesh
    if is_band(part, strategy):
        first, last = band_borders(part, strategy)
        around = _across_band(part, first, last, strategy.stepover_m)
        return around, lines_at(part, around, strategy)
    chosen, best, most = np.zeros(len(mesh.vertices)), list[MeshLine](), -1.0
    past = most
    ends = ends_of(mesh) if part.outward is not None else None
    if ends is not None and ends.length_m**2 <= _STRIP * float(mesh.areas.sum()):
        ends = None
    narrow = ends is not None and width(mesh) < _NARROW * strategy.stepover_m
    direction = None if narrow else strategy.direction
    along = line_direction(part, direction)
    extent = float(np.ptp(mesh.vertices @ along)) if ends is None else ends.length_m
    for across in across_directions(part, along):
        height = height_over_middle(part, across)
        # Around a closed part the plane's lines are followed, around bends as well.
        ways: tuple[Callable[[FineMesh, np.ndarray], np.ndarray], ...] = (
            (distance_across,) if part.outward is not None else (signed_distance, distance_across)
        )
        if even_share(mesh, height, _STEEP) > _ALL:
            ways = (_as_it_is,)  # on a plane a height is a distance already
        for way in ways:
            distance = way(mesh, height)
            lines = lines_at(part, distance, strategy, tail=_TAIL if narrow else SPIKE)
            even = even_share(mesh, distance)
            value = usual_length(lines) * even
            if value > _BETTER * most:
                chosen, best, most = distance, lines, value
                past = _length_past_holes(lines) * even
            if value >= _WHOLE * extent:
                return chosen, best
    if ends is not None and direction is None:
        followed = _across_strip(part, ends)
        lines = lines_at(part, followed, strategy, tail=_TAIL)
        # What lies in the way of straight lines makes no strip that bends.
        if usual_length(lines) * even_share(mesh, followed) > _BETTER * past:
            chosen, best = followed, lines
    return chosen, best


def _as_it_is(_: FineMesh, height: np.ndarray) -> np.ndarray:
    return height


def usual_length(lines: Sequence[MeshLine]) -> float:
    """Mean length of the line that a place of the lines is on, m: short pieces count little."""
    length = np.array([total_length(line.points) for line in lines])
    return float((length**2).sum() / max(float(length.sum()), 1e-300))


def _length_past_holes(lines: Sequence[MeshLine]) -> float:
    """As `usual_length`, m, where the pieces of one level are one line."""
    level = np.array([line.level for line in lines], int)
    length = np.bincount(level, [total_length(line.points) for line in lines])
    return float((length**2).sum() / max(float(length.sum()), 1e-300))


def line_direction(part: Part, direction: np.ndarray | None) -> np.ndarray:
    """The unit direction (3,) of a part's lines: the one given, along it; or its longest extent.

    Raises ProcessError for one that stands on it.
    """
    if direction is None:
        sides = main_direction(part)
        along = part.axes[0] if sides is None else sides
    else:
        along = unit_vectors(np.asarray(direction, dtype=np.float64)[None])[0]
    if part.outward is None:
        return np.asarray(along)
    flat = along - (along @ part.outward) * part.outward
    length = float(np.linalg.norm(flat))
    if length >= LEAST_IN_SURFACE:
        return np.asarray(flat / length)
    if direction is None:
        return line_direction(part, part.axes[1])
    raise ProcessError(
        f"direction {np.asarray(direction).tolist()} stands on the region instead of running along "
        "it; give one along the surface, or none for the region's longest extent"
    )


def across_directions(part: Part, along: np.ndarray) -> list[np.ndarray]:
    """Directions (3,) across the lines, the likeliest first: one on an open part, two on a closed
    one."""
    if part.outward is not None:
        return [np.cross(part.outward, along)]
    away = part.mesh.centres - part.centre
    away = away - np.outer(away @ along, along)
    axes = np.linalg.eigh((away * part.mesh.areas[:, None]).T @ away)[1]
    return [axes[:, 2], axes[:, 1]]


def height_over_middle(part: Part, across: np.ndarray) -> np.ndarray:
    """Signed height (v,) over the plane that halves a part's area, m."""
    height = part.mesh.vertices @ across
    order = np.argsort(height)
    share = np.cumsum(part.mesh.mass[order])
    return np.asarray(height - np.interp(0.5 * share[-1], share, height[order]))


def _across_strip(part: Part, ends: Ends) -> np.ndarray:
    """A distance (v,) across a strip, m, whose lines run along it from end to end.

    A flow from end to end runs along the strip's sides; what stands on it leads across. At the ends
    themselves, where it spreads, it goes on as it is farther inside.
    """
    mesh = part.mesh
    flow = mesh.slopes(_between(part, ends.first, ends.last))
    across = unit_vectors(np.cross(mesh.normals, flow))
    wide = float(mesh.areas.sum()) / ends.length_m
    spread = ends.away[mesh.faces].mean(axis=1) < min(_SPREAD * wide, _ENDS * ends.length_m)
    inner = np.flatnonzero(~spread)
    if len(inner):
        across[spread] = across[inner[cKDTree(mesh.centres[inner]).query(mesh.centres[spread])[1]]]
    return even_field(mesh, across, _ROUNDS)


def _across_band(part: Part, first: np.ndarray, last: np.ndarray, stepover_m: float) -> np.ndarray:
    """A distance (v,) across a band, m, from its one border to its other."""
    share = _between(part, first, last)
    across = float(part.mesh.areas.sum()) / float(part.mesh.border_loops()[1].max())
    if across <= stepover_m:
        return across * share  # the middle line, also where the band is wider or narrower
    return even_field(part.mesh, unit_vectors(part.mesh.slopes(share)), _ROUNDS)


def _between(part: Part, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """A smooth function (v,) that is 0 at the vertices (a,) and 1 at (b,)."""
    mesh = part.mesh
    fixed = np.zeros(len(mesh.vertices), bool)
    fixed[first] = fixed[last] = True
    values = np.zeros(len(mesh.vertices))
    values[last] = 1.0
    free = np.flatnonzero(~fixed)
    if len(free):
        inner = csc_matrix(mesh.stiffness[free][:, free])
        values[free] = factor(inner).solve(-(mesh.stiffness[free] @ values))
    return values
