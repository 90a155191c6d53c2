"""How large a plan on a mesh would be, estimated before planning, so that planning always ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.units import readable
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.strategy import Strategy

MOST_WAYPOINTS, MOST_LINES = 200_000, 10_000
"""Of a process, all its passes together."""
_MOST_PLACES = 1_000_000  # at which lines are laid out, and the tool's footprint is looked at
_CELLS = 8.0  # triangles for each square of a stepover, that planners work on
_PARTS = 3.0  # of the radius, from one place of a footprint to the next


@dataclass(frozen=True)
class PlanSize:
    """Estimates.

    area: m², of the region; extent: (length, width), m, of the region in space, the longest first;
    length: m, of all lines of a pass; lines, waypoints: of all passes; places: triangles on which a
    pass's lines are laid out; samples: of its footprint.
    """

    area: float
    extent: tuple[float, float]
    length: float
    lines: float
    waypoints: float
    places: float
    samples: float


def estimate_size(region: RegionMesh, strategy: Strategy) -> PlanSize:
    """What a strategy would plan on a region, about."""
    stepover, area = strategy.stepover_m, region.area_m2
    long, wide = _extent(region)
    sweeps = 2.0 if strategy.trajectory == "cross-hatch" else 1.0
    length = sweeps * area / stepover
    lines = max(length / long, sweeps)
    if strategy.trajectory == "edge":
        length = region.mesh.border_length
        lines = len(region.boundary_loops)
    rising = 2.0 * strategy.run_off_m * lines
    return PlanSize(
        area=area,
        extent=(long, wide),
        length=length,
        lines=strategy.passes * lines,
        waypoints=strategy.passes * ((length + rising) / strategy.spacing_m + 2.0 * lines),
        places=_CELLS * area / stepover**2,
        samples=_PARTS * length / strategy.tool_radius_m,
    )


def check_size(region: RegionMesh, strategy: Strategy) -> None:
    """Raise ProcessError, saying what would be planned, for more than can be; and for a stepover
    wider than the region."""
    size = estimate_size(region, strategy)
    stepover = f"stepover_m {strategy.stepover_m:g} ({readable('_m', strategy.stepover_m)})"
    where = f"on the region's {size.area:.3g} m²"
    long, wide = size.extent
    if strategy.stepover_m > long:
        raise ProcessError(
            f"stepover_m is {strategy.stepover_m:g}, wider than the region, which measures "
            f"{long:.3g} by {wide:.3g} m; give less than {long:.3g}"
        )
    if size.waypoints > MOST_WAYPOINTS or size.lines > MOST_LINES:
        raise ProcessError(
            f"about {in_words(size.waypoints)} waypoints on {in_words(size.lines)} lines would be "
            f"planned {where}, with {stepover}, spacing_m {strategy.spacing_m:g} "
            f"({readable('_m', strategy.spacing_m)}) and passes {strategy.passes}; at most "
            f"{in_words(MOST_WAYPOINTS)} on {in_words(MOST_LINES)} are. Give more stepover_m or "
            "spacing_m, fewer passes, or cut the region into several"
        )
    if size.places > _MOST_PLACES:
        raise ProcessError(
            f"{stepover} is too fine for a {strategy.trajectory} {where}: it would have to be laid "
            f"out on about {in_words(size.places)} triangles, at most {in_words(_MOST_PLACES)} "
            "are. Give more, or cut the region into several"
        )
    if size.samples > _MOST_PLACES:
        radius = f"{strategy.tool_radius_m:g} ({readable('_m', strategy.tool_radius_m)})"
        raise ProcessError(
            f"tool.radius_m {radius} does not go with {stepover} {where}: lines of about "
            f"{in_words(size.length)} m would have to be looked at {in_words(size.samples)} times "
            "to tell what the footprint reaches. Give radius and stepover of one size"
        )


def check_passes(waypoints: int, lines: int, passes: int) -> None:
    """Raise ProcessError for given lines that are driven so often that they are too many."""
    if passes * waypoints > MOST_WAYPOINTS or passes * lines > MOST_LINES:
        raise ProcessError(
            f"{passes} passes over {in_words(waypoints)} waypoints on {in_words(lines)} lines are "
            f"{in_words(passes * waypoints)} on {in_words(passes * lines)}; at most "
            f"{in_words(MOST_WAYPOINTS)} on {in_words(MOST_LINES)} are driven. Give fewer passes, "
            "or fewer waypoints"
        )


def in_words(value: float) -> str:
    """A number as people read it, rounded to two digits."""
    return f"{float(f'{value:.2g}'):,.0f}" if value < 1e15 else f"{value:.0e}"


def _extent(region: RegionMesh) -> tuple[float, float]:
    """Length and width, m, of a region along its principal axes in space."""
    away = region.mesh.vertices - region.mesh.vertices.mean(axis=0)
    axes = np.linalg.svd(away, full_matrices=False)[2]
    long, wide = np.sort(np.ptp(away @ axes.T, axis=0))[::-1][:2]
    return float(long), float(wide)
