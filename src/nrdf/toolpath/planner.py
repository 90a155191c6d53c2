"""The planner: from a strategy and a region of a surface to the segments that a robot drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from nrdf.errors import ProcessError
from nrdf.surface.accessibility import accessible_points
from nrdf.surface.patch import Patch, inside_margin, patches_of
from nrdf.surface.surface import Surface
from nrdf.toolpath.contour import contour, spiral
from nrdf.toolpath.gap_filling import fill_missed_points, fill_wide_gaps
from nrdf.toolpath.modifiers.minimum_length import minimum_length
from nrdf.toolpath.modifiers.order import order_nearest
from nrdf.toolpath.modifiers.smooth_orientation import smooth_orientation
from nrdf.toolpath.modifiers.split import split
from nrdf.toolpath.plan_size import check_size
from nrdf.toolpath.raster import raster
from nrdf.toolpath.sampled_path import line_spacing, sample_lines
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import (
    PlanarPath,
    SurfacePath,
    order_nearest_first,
    place_on_surface,
)
from nrdf.toolpath.tool_segments import add_approach_retract, tool_segments
from nrdf.toolpath.types import Segment

LEAST_IN_SURFACE = 0.2
"""A direction with a smaller share of its length in a patch's surface gives no direction there."""
_LARGEST_STEP = 2.0  # spacings between waypoints of one line
_LARGEST_TILT_RAD = float(np.radians(5.0))  # of the axis off its own, where its turn is limited
_TRIES, _WIDE = 3, 1.1  # of lines that are more stepovers apart


def plan(surface: Surface, region: np.ndarray, strategy: Strategy) -> tuple[Segment, ...]:
    """Segments that work `region`, indices (k,) of the surface's points, in driving order.

    The region is cut into patches that lie flat without folds (`nrdf.surface.patch`), and each into
    lines; what those leave out nearby has short lines of its own. Every line has its approach,
    process and retract segments; an approach or retract distance of 0 leaves its segments out.
    Points that the tool cannot access (`nrdf.surface.accessibility`) are left out like holes.
    Raises ProcessError for a margin or clearance that leaves nothing of the region, a stepover
    wider than it, a direction that stands on it, or more than `nrdf.toolpath.plan_size` allows.
    """
    region = accessible_points(surface, region, strategy.clearance_m)
    patches = patches_of(surface, region)
    _check_stepover(patches, strategy)
    check_size(patches, strategy)
    wanted = inside_margin(surface, region, patches, strategy.edge_margin_m)
    points, outward = surface.points[wanted], surface.normals[wanted]
    reach, apart = strategy.tool_radius_m, strategy.stepover_m
    sweeps: list[list[SurfacePath]] = []
    for sweep in _sweeps(patches, strategy):
        found = [
            block
            for patch, paths in sweep
            for block in _evenly_spaced(surface, patch, paths, strategy)
        ]
        drawn = [line for block in order_nearest_first(found) for line in block]
        drawn = _steady(drawn, points, outward, strategy)
        drawn = minimum_length(drawn, reach, points, outward, reach)
        filled = fill_wide_gaps(surface, patches, drawn, strategy.spacing_m, reach, apart)
        sweeps.append([*drawn, *filled])
    if not any(sweeps):
        deepest = max(patch.border.deepest for patch in patches)
        raise ProcessError(
            f"edge_margin_m is {strategy.edge_margin_m:g}, which leaves nothing of the region: its "
            f"innermost place is {deepest:.3g} m from its border; give less than that"
        )
    every_line = [line for made in sweeps for line in made]
    sweeps[-1] += fill_missed_points(surface, wanted, every_line, strategy.spacing_m, reach, apart)
    lines = [
        line for made in sweeps for line in order_nearest(_steady(made, points, outward, strategy))
    ]
    contacts, normals = [line.contacts for line in lines], [line.normals for line in lines]
    return add_approach_retract(tool_segments(contacts, normals, strategy), normals, strategy)


def _steady(
    lines: Sequence[SurfacePath],
    points: np.ndarray,
    normals: np.ndarray,
    strategy: Strategy,
) -> list[SurfacePath]:
    """Lines without steps above twice the spacing, whose axis turns no faster than its limit.

    Pieces of lines that were split go where they are short and reach none of points (n, 3), with
    outward normals (n, 3), alone.
    """
    parts = [
        smooth_orientation(
            split([line], _LARGEST_STEP * strategy.spacing_m), largest_tilt_rad=_LARGEST_TILT_RAD
        )
        for line in lines
    ]
    pieces = np.array([len(part) > 1 for part in parts for _ in part], dtype=bool)
    whole, radius = [line for part in parts for line in part], strategy.tool_radius_m
    return minimum_length(whole, radius, points, normals, radius, droppable=pieces)


def _check_stepover(patches: Sequence[Patch], strategy: Strategy) -> None:
    length, width, _ = max((patch.extent for patch in patches), key=lambda extent: extent[0])
    if strategy.stepover_m > length:
        raise ProcessError(
            f"stepover_m is {strategy.stepover_m:g}, wider than the region, which measures "
            f"{length:.3g} by {width:.3g} m; give less than {length:.3g}"
        )


def _sweeps(
    patches: Sequence[Patch], strategy: Strategy
) -> list[list[tuple[Patch, Callable[[float], list[list[PlanarPath]]]]]]:
    """For each sweep over the region, every patch with its paths, by parts, at a stepover."""
    margin = strategy.edge_margin_m
    if strategy.trajectory in ("contour", "spiral"):
        way = contour if strategy.trajectory == "contour" else spiral
        return [[(patch, partial(way, patch, margin_m=margin)) for patch in patches]]
    angles = _angles(patches, strategy.direction)
    turns = (0.0, np.pi / 2) if strategy.trajectory == "cross-hatch" else (0.0,)
    return [
        [
            (patch, partial(raster, patch, angle + turn, margin_m=margin))
            for patch, angle in zip(patches, angles, strict=True)
        ]
        for turn in turns
    ]


def _evenly_spaced(
    surface: Surface,
    patch: Patch,
    paths: Callable[[float], list[list[PlanarPath]]],
    strategy: Strategy,
) -> list[list[SurfacePath]]:
    """Blocks of lines on a patch, nowhere much farther apart than a stepover.

    On few points, or round an edge, the patch's plane tells distances along the surface less well
    than lines that are there, and turns of a spiral are farther apart in corners: if lines are too
    far apart, they are drawn again, closer.
    """
    wanted = stepover = strategy.stepover_m
    best, least = [], np.inf
    for _ in range(_TRIES):
        blocks = place_on_surface(
            surface, patch, paths(stepover), strategy.spacing_m, strategy.tool_radius_m
        )
        lines = [line for block in blocks for line in block]
        if not lines:
            break
        sampled = sample_lines(lines, strategy.tool_radius_m, wanted)
        apart = line_spacing([patch], sampled, wanted).distance
        wide = float((apart > _WIDE * wanted).mean()) if len(apart) else 0.0
        if wide < least:
            best, least = blocks, wide
        # Where but a few places are too far from the next line, the line is broken there.
        usual = float(np.quantile(apart, 0.9)) if len(apart) else 0.0
        if wide == 0.0 or usual <= wanted:
            break
        stepover *= max(wanted / usual, 0.75)
    return best


def _angles(patches: Sequence[Patch], direction: np.ndarray | None) -> list[float]:
    """The angle of a raster's lines in the plane of each patch."""
    longest = [patch.extent[2] for patch in patches]
    if direction is None:
        return longest
    seen = [patch.angle_of(np.asarray(direction, dtype=np.float64)) for patch in patches]
    if max(share for _, share in seen) < LEAST_IN_SURFACE:
        raise ProcessError(
            f"direction {np.asarray(direction).tolist()} stands on the region instead of running "
            "along it; give one along the surface, or none for the region's longest extent"
        )
    return [
        angle if share >= LEAST_IN_SURFACE else other
        for (angle, share), other in zip(seen, longest, strict=True)
    ]
