"""More lines where a planner's lines leave area that the footprint doesn't reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.polylines import total_length
from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import Part
from nrdf.toolpath.planners.level_lines import MeshLine, cut_where, level_lines, resampled
from nrdf.toolpath.sampled_path import reached_points
from nrdf.toolpath.strategy import Strategy

_MISSED = 0.008  # share of a part's area that may be missed
_MOST = 0.4  # of a line that must be missed to drive it whole
_ROUNDS, _PLACES, _BINS = 8, 6000, 0.25


def fill_missed_area(
    region: RegionMesh,
    part: Part,
    values: np.ndarray,
    lines: Sequence[MeshLine],
    strategy: Strategy,
) -> list[MeshLine]:
    """Level lines of `values` (v,) of a part, with more where the footprint misses some of it.

    A tool reaches only what faces it: the sides of a slat that is thinner than a stepover are
    missed by lines on its top and bottom. Each new line lies where most is missed, along that only.
    """
    found = list(lines)
    mesh = part.mesh
    inner = np.arange(len(mesh.faces))
    if strategy.edge_margin_m > 0.0 and part.border_distance is not None:
        inside = part.border_distance[mesh.faces].mean(axis=1) > strategy.edge_margin_m
        inner = np.flatnonzero(inside)
    if not len(inner) or not found:
        return found
    generator = np.random.default_rng(0)
    share = mesh.areas[inner] / mesh.areas[inner].sum()
    chosen = inner[generator.choice(len(inner), min(_PLACES, 4 * len(inner)), p=share)]
    points, normals = mesh.centres[chosen], mesh.normals[chosen]
    at = values[mesh.faces[chosen]].mean(axis=1)
    missed = ~_reached(region, part, found, points, normals, strategy)
    width = _BINS * strategy.stepover_m
    for _ in range(_ROUNDS):
        if missed.mean() <= _MISSED:
            break
        height = np.floor((at[missed] - at.min()) / width).astype(int)
        peak = int(np.bincount(height).argmax())
        level = float(np.median(at[missed][height == peak]))
        tree = cKDTree(points[missed])
        pieces = []
        for line in part.inside(
            level_lines(mesh, values, np.array([level])), strategy.edge_margin_m
        ):
            near = strategy.tool_radius_m - tree.query(line.points)[0]
            pieces += [
                replace(piece, level=_level_beside(found, values, level))
                for piece in ([line] if (near > 0.0).mean() > _MOST else cut_where(line, near))
                if total_length(piece.points) >= strategy.tool_radius_m
            ]
        reached = np.zeros(len(points), bool)
        if pieces:
            reached = _reached(region, part, pieces, points, normals, strategy) & missed
        if not reached.any():
            # No line here would be long enough: what is missed here stays so.
            at = np.where(missed & (np.abs(at - level) < width), np.inf, at)
            kept = np.isfinite(at)
            points, normals, at, missed = points[kept], normals[kept], at[kept], missed[kept]
            continue
        found += pieces
        missed &= ~reached
    return found


def _reached(
    region: RegionMesh,
    part: Part,
    lines: Sequence[MeshLine],
    points: np.ndarray,
    normals: np.ndarray,
    strategy: Strategy,
) -> np.ndarray:
    """Whether (m,) a footprint on the lines reaches points (m, 3) of normals (m, 3)."""
    radius = strategy.tool_radius_m
    placed = [resampled(line, radius / 3.0) for line in lines]
    places = np.concatenate([place for place, _ in placed])
    faces = part.mesh.origin[np.concatenate([face for _, face in placed])]
    axes = -region.mesh.smooth_normals(places, faces, radius)
    return reached_points(points, normals, places, axes, radius)


def _level_beside(lines: Sequence[MeshLine], values: np.ndarray, level: float) -> int:
    """Number of the line whose value is nearest to a level."""
    of_lines = [float(line.values(values)[len(line.points) // 2]) for line in lines]
    return lines[int(np.argmin(np.abs(np.array(of_lines) - level)))].level
