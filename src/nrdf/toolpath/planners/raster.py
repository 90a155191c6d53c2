"""Raster: lines of one direction, even along the surface, in snake order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part, checked, driven, parts_of
from nrdf.toolpath.planners.flat_sheets import is_bore, joined_in_planes, with_room
from nrdf.toolpath.planners.reach import reached_from_paths
from nrdf.toolpath.planners.rod_strokes import rod_strokes
from nrdf.toolpath.planners.sheet_lines import line_direction, sheet_lines
from nrdf.toolpath.planners.sheets import is_band, is_round_rod, pieces_of, sheets_of, width
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_LARGE, _LEFT = 3.0, 0.2
"""Footprints: smaller sheets are asked for what is left of them, which must be that large."""
_FRAME, _ARM = 4.0, 0.3  # stepovers that a frame's bars are wide; footprints that are left
_STRIPE = 0.55  # stepovers: what is no farther from a line is no rest to be worked
_LEFT_SHORT = 0.02  # of the region: what must be left of a sheet that is shorter than the radius


def plan_raster(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Lines at even distances along the surface from a middle line in the strategy's direction.

    Every sheet of the region, as the top, underside and edges of a slab, has lines of its own: in
    that direction, along it where it is narrow. Round rods get strokes along them. Raises
    ProcessError for a margin that leaves nothing, and a direction that stands on the region.
    """
    return checked(raster_of(region, parts_of(region, strategy), strategy), strategy)


def raster_of(
    region: RegionMesh,
    parts: Sequence[Part],
    strategy: Strategy,
    beside: Sequence[SurfacePath] = (),
) -> list[SurfacePath]:
    """The raster of some parts of a region, without small sheets that paths beside them reach."""
    found: list[SurfacePath] = []
    for sheet in _sheets(region, parts, strategy):
        if is_needed(region, sheet, [*beside, *found], strategy):
            found += _sheet_paths(region, sheet, strategy, [*beside, *found])
    return found


def plan_cross_hatch(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """A raster, and a second one across it. Raises ProcessError as `plan_raster` does."""
    found: list[SurfacePath] = []
    across: list[SurfacePath] = []
    for sheet in _sheets(region, parts_of(region, strategy), strategy):
        if is_needed(region, sheet, found, strategy):
            found += _sheet_paths(region, sheet, strategy, found)
            along = line_direction(sheet, strategy.direction)
            outward = sheet.axes[2] if sheet.outward is None else sheet.outward
            turned = replace(strategy, direction=np.cross(outward, along))
            across += _sheet_paths(region, sheet, turned, across)
    return checked(found + across, strategy)


def _sheet_paths(
    region: RegionMesh, sheet: Part, strategy: Strategy, beside: Sequence[SurfacePath]
) -> list[SurfacePath]:
    """Paths on one sheet: what its lines leave, as the arms of a frame, is worked after it."""
    if not sheet.slits and not is_band(sheet, strategy) and is_round_rod(sheet):
        strokes = rod_strokes(region, sheet, strategy)
        if strokes:
            return strokes
    paths = driven(region, sheet, sheet_lines(region, sheet, strategy, beside), strategy)
    if not paths or width(sheet.mesh) > _FRAME * strategy.stepover_m:
        return paths
    radius = strategy.tool_radius_m
    # Stripes between lines that are farther apart than the tool is wide are meant to stay.
    left = ~reached_from_paths(sheet, [*beside, *paths], max(radius, _STRIPE * strategy.stepover_m))
    if strategy.edge_margin_m > 0.0 and sheet.margin_distance is not None:
        left &= sheet.margin_distance[sheet.mesh.faces].mean(axis=1) > strategy.edge_margin_m
    least = _ARM * np.pi * radius**2
    if left.all() or float(sheet.mesh.areas[left].sum()) < least:
        return paths
    for piece in pieces_of(sheet, left):
        if float(piece.mesh.areas.sum()) >= least:
            paths += _sheet_paths(region, piece, strategy, [*beside, *paths])
    return paths


def _sheets(region: RegionMesh, parts: Sequence[Part], strategy: Strategy) -> list[Part]:
    """All sheets of parts, those of the first part first, large ones before small ones."""
    sheets = [sheet for part in parts for sheet in sheets_of(region, part, strategy)]
    sheets = with_room(region, sheets, strategy.tool_radius_m)
    holes = [is_bore(region, sheet, strategy.tool_radius_m) for sheet in sheets]
    if not all(holes):
        sheets = [sheet for sheet, hole in zip(sheets, holes, strict=True) if not hole]
    if strategy.edge_margin_m > 0.0:
        return sheets
    return joined_in_planes(sheets, strategy.tool_radius_m)


def is_needed(
    region: RegionMesh, sheet: Part, paths: Sequence[SurfacePath], strategy: Strategy
) -> bool:
    """Whether a sheet that is no larger than a few footprints has area that no path reaches yet."""
    mesh, radius = sheet.mesh, strategy.tool_radius_m
    footprint = np.pi * radius**2
    if float(mesh.areas.sum()) > _LARGE * footprint or not paths:
        return True
    left = float(mesh.areas[~reached_from_paths(sheet, paths, radius)].sum())
    long = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))) >= radius
    return left >= (_LEFT * footprint if long else _LEFT_SHORT * region.area_m2)
