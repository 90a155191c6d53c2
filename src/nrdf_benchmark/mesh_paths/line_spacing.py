"""How far a stroke's neighbours are, on both sides of each of its places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import arc_length, even_arc_lengths, interpolate
from nrdf.toolpath.frames import travel_directions
from nrdf.toolpath.strategy import Strategy

ALIKE = 0.5  # cosine between normals of one side
_PARALLEL = 0.8  # cosine between the travel of neighbouring lines
_BESIDE, _SAME = 2.2, 0.2  # stepovers: the farthest neighbour, and the nearest that is another line
_AHEAD = 0.25  # stepovers: a neighbour that begins so far ahead or behind is beside
_SURFACE = 0.25  # stepovers: where no surface is so near, a hole parts neighbours
_PARTS = 8  # samples a tool radius


@dataclass(frozen=True)
class Line:
    """A stroke at even steps: points, outward normals and travel (n, 3), m."""

    points: np.ndarray
    normals: np.ndarray
    travel: np.ndarray

    @classmethod
    def of(cls, contacts: np.ndarray, axes: np.ndarray, strategy: Strategy) -> Line:
        """From contacts and tool axes (n, 3)."""
        along = arc_length(contacts)
        at = even_arc_lengths(float(along[-1]), strategy.tool_radius_m / _PARTS)
        points = interpolate(at, along, contacts)
        normals = -unit_vectors(interpolate(at, along, axes))
        return cls(points, normals, travel_directions(points))


def line_spacing(
    lines: Sequence[Line],
    stepover_m: float,
    region_points: np.ndarray,
    region_normals: np.ndarray,
    point_area_m2: float,
) -> np.ndarray:
    """Distances (m,), m, along the surface to the next line on each side that has one.

    A line counts where it is parallel, on the same side of the part, and abreast: so a break
    shorter than half a stepover is none. A stroke that turns back is its own neighbour. Between
    neighbours there must be surface of the region, given as points (p, 3) with normals (p, 3), each
    for an area: what a hole parts are no neighbours. A chord's arc is told from the normals at its
    ends. Lines that cross do not count.
    """
    points = np.concatenate([line.points for line in lines])
    normals = np.concatenate([line.normals for line in lines])
    travel = np.concatenate([line.travel for line in lines])
    tree, surface = cKDTree(points), cKDTree(region_points)
    reach = max(_SURFACE * stepover_m, 1.5 * float(np.sqrt(point_area_m2)))
    found: list[float] = []
    asked = np.arange(0, len(points), 2)
    around = tree.query_ball_point(points[asked], _BESIDE * stepover_m)
    for i, near in zip(asked, around, strict=True):
        k = np.array(near)
        offset = points[k] - points[i]
        cosine = normals[k] @ normals[i]
        ahead = offset @ travel[i]
        chosen = (np.abs(ahead) < _AHEAD * stepover_m) & (cosine > ALIKE)
        chosen &= np.abs(travel[k] @ travel[i]) > _PARALLEL
        bend = np.arccos(np.clip(cosine, -1.0, 1.0))
        across = np.linalg.norm(offset - ahead[:, None] * travel[i], axis=1)
        length = across / np.maximum(np.sinc(bend / (2.0 * np.pi)), 0.1)
        side = offset @ np.cross(normals[i], travel[i])
        for beside in (side > _SAME * stepover_m, side < -_SAME * stepover_m):
            there = np.flatnonzero(chosen & beside)
            if not len(there):
                continue
            nearest = there[int(np.argmin(length[there]))]
            middle = 0.5 * (points[i] + points[k[nearest]])
            on = surface.query_ball_point(middle, reach)
            if (region_normals[on] @ normals[i] > ALIKE).any():
                found.append(float(length[nearest]))
    return np.array(found)
