"""Rod: few long strokes along a leg or a rail, and a raster on what is none."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.surface.region_mesh import RegionMesh
from nrdf.toolpath.planners.field_lines import SPECK, Part, checked, closed_border, refined
from nrdf.toolpath.planners.flat_sheets import is_bore, is_flat
from nrdf.toolpath.planners.raster import raster_of
from nrdf.toolpath.planners.reach import reached_from_paths
from nrdf.toolpath.planners.reeb_graph import touching_faces
from nrdf.toolpath.planners.rod_strokes import rods_of, strokes_of
from nrdf.toolpath.planners.sheets import pieces_of
from nrdf.toolpath.strategy import Strategy
from nrdf.toolpath.surface_path import SurfacePath

_WIDE, _CAP = 0.3, 0.75
"""Tool radii: what is left is wider; and squares of them: a flat end is larger."""


def plan_rod(region: RegionMesh, strategy: Strategy) -> list[SurfacePath]:
    """Strokes from end to end of every rod. What is no rod gets a raster, as do ends that are
    large; holes for screws, which the tool does not fit into, get nothing.

    Raises ProcessError for a margin that leaves nothing.
    """
    found: list[SurfacePath] = []
    others: list[Part] = []
    radius = strategy.tool_radius_m
    for part in _touching_parts(region, strategy):
        rods, _ = rods_of(part, strategy)
        strokes = [path for rod in rods for path in strokes_of(region, part, rod, strategy)]
        found += strokes
        if not strokes:
            others += [Part(mesh, closed=part.closed) for mesh in part.mesh.components()]
            continue
        left = ~reached_from_paths(part, strokes, radius)
        for piece in pieces_of(part, left):
            if _is_wide(piece, strategy.tool_radius_m) and not is_bore(
                region, piece, strategy.tool_radius_m
            ):
                found += raster_of(region, [piece], strategy, found)
    if found:
        others = [part for part in others if not is_bore(region, part, radius)]
    return checked(found + raster_of(region, others, strategy, found), strategy)


def _touching_parts(region: RegionMesh, strategy: Strategy) -> list[Part]:
    """The parts of a region, largest first; what touches along a seam is one part."""
    fine = refined(region, strategy)
    touching = touching_faces(fine)
    count = len(fine.faces)
    face = np.concatenate([np.repeat(np.arange(count), 3), touching[:, 0]])
    joint = np.concatenate([count + fine.faces.ravel(), touching[:, 1]])
    size = count + len(fine.vertices)
    net = coo_matrix((np.ones(len(face), bool), (face, joint)), (size, size))
    number = connected_components(net, directed=False)[1][:count]
    area = np.bincount(number, fine.areas)
    least = SPECK * np.pi * strategy.tool_radius_m**2
    order = [k for k in np.argsort(-area, kind="stable") if area[k] > 0.0]
    chosen = [k for k in order if area[k] >= least] or order[:1]
    closed = closed_border(region, strategy)
    return [Part(fine.part(number == k), closed=closed) for k in chosen]


def _is_wide(part: Part, radius_m: float) -> bool:
    """Whether a part that was left is worth a line of its own."""
    area = float(part.mesh.areas.sum())
    if area < (_CAP * radius_m**2 if is_flat(part) else SPECK * np.pi * radius_m**2):
        return False
    return area >= _WIDE * radius_m * float(np.ptp(part.mesh.vertices @ part.axes[0]))
