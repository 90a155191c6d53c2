"""Even samples of a region's mesh, which tell how much of it a tool works, and why not all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.sampling import spread_in_triangles
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh
from nrdf.surface.tool_clearance import accessible_region, has_clearance, needed_clearance
from nrdf.toolpath.closed_border import ClosedBorder
from nrdf.toolpath.planners.distance import distance_from
from nrdf.toolpath.strategy import Strategy

_PER_RADIUS = 4.0  # samples along the tool's radius
_FEWEST, _MOST = 400, 20_000
_FINE = 3.0  # edges along the margin

NO_CLEARANCE, MARGIN = "no_clearance", "edge_margin"
REASONS = {NO_CLEARANCE: "no clearance for the tool", MARGIN: "edge margin"}
"""Why a part of a region is left out, in words."""


@dataclass(frozen=True)
class Coverage:
    """What becomes of a whole region, in shares [0, 1] of its area that add up to 1.

    worked: the footprint reaches it. left_out: by reason (`REASONS`): no_clearance, where less is
    free before the surface than the tool needs (`nrdf.surface.tool_clearance`), whether the
    footprint reaches it or not, and edge_margin, inside it and not reached. unreached: it should
    be worked, and is not.
    """

    worked: float
    left_out: dict[str, float]
    unreached: float


@dataclass(frozen=True, eq=False)
class RegionSamples:
    """Points (m, 3), m, on a region's mesh, each of which stands for the same area, with outward
    unit normals (m, 3).

    accessible: (m,) whether the tool has its clearance there. inside_margin: (m,) whether a point
    is not in the edge margin: at least that far, along the surface, from the border of what is
    accessible, or from that border closed (`nrdf.toolpath.closed_border`).
    """

    points: np.ndarray
    normals: np.ndarray
    accessible: np.ndarray
    inside_margin: np.ndarray

    @staticmethod
    def of(region: RegionMesh, strategy: Strategy) -> RegionSamples:
        """Samples a quarter of the tool's radius apart, about, of the whole region.

        The same for the same region. Raises ProcessError where the tool has its clearance nowhere.
        """
        margin = strategy.edge_margin_m
        key = (RegionSamples, strategy.tool_radius_m, strategy.clearance_m, margin)
        if key not in region.memo:
            region.memo[key] = RegionSamples._of(region, strategy)
        kept: RegionSamples = region.memo[key]
        return kept

    @staticmethod
    def _of(region: RegionMesh, strategy: Strategy) -> RegionSamples:
        points, faces = sample_evenly(region.mesh, strategy.tool_radius_m / _PER_RADIUS)
        normals = region.mesh.face_normals[faces]
        needed = needed_clearance(strategy.clearance_m, strategy.tool_radius_m)
        places, _, _ = region.on_parent(points, normals)
        free = has_clearance(region.parent, places, normals, needed)
        inside: np.ndarray = np.ones(len(points), bool)
        margin = strategy.edge_margin_m
        if margin > 0.0:
            left = accessible_region(region, strategy.clearance_m, strategy.tool_radius_m)
            closed = ClosedBorder.of(left, strategy.tool_radius_m)
            away = border_distance(left.mesh, points, normals, margin)
            away = np.where(away > 0.0, np.maximum(away, closed.distance(points)), away)
            inside = away >= margin
        return RegionSamples(points, normals, free, inside)

    @property
    def wanted(self) -> np.ndarray:
        """Whether (m,) a point should be worked: it is accessible and inside the margin."""
        return self.accessible & self.inside_margin

    def coverage(self, reached: np.ndarray) -> Coverage:
        """The shares, where a footprint reaches (m,) of the points."""
        free, missed = self.accessible, self.accessible & ~reached
        worked, margin = free & reached, missed & ~self.inside_margin
        left_out = {NO_CLEARANCE: float((~free).mean()), MARGIN: float(margin.mean())}
        missed = missed & self.inside_margin
        return Coverage(float(worked.mean()), left_out, float(missed.mean()))


def sample_evenly(mesh: TargetMesh, spacing_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (m, 3), m, on a mesh, about `spacing_m` apart, and their faces (m,).

    Each stands for the same area. Not random: the same for the same mesh. At least some hundred,
    and at most 20,000 of them. Raises ProcessError for a mesh without area.
    """
    share = np.cumsum(mesh.face_areas)
    if not len(share) or not share[-1] > 0.0:
        raise ProcessError("a region without area cannot be sampled")
    count = int(np.clip(np.ceil(share[-1] / spacing_m**2), _FEWEST, _MOST))
    at = (np.arange(count) + 0.5) / count * share[-1]
    faces = np.minimum(np.searchsorted(share, at), len(share) - 1)
    return spread_in_triangles(mesh.vertices[mesh.faces[faces]]), faces


def border_distance(
    mesh: TargetMesh, points: np.ndarray, normals: np.ndarray, reach_m: float
) -> np.ndarray:
    """Distance (m,) along a mesh from its border, m, at points (m, 3) of its side, normals (m, 3).

    Exact to about a third of `reach_m`; infinite on parts without a border, and 0 off the mesh.
    """
    fine = refine(mesh.vertices, mesh.faces, reach_m / _FINE)
    whole = FineMesh(fine.vertices, fine.faces, np.arange(len(fine.faces)), fine.edge_m)
    distance: np.ndarray = np.full(len(fine.faces) * 3, np.inf).reshape(-1, 3)
    for part in whole.components():
        if len(part.border):
            distance[part.origin] = distance_from(part, part.border)[part.faces]
    surface = TargetMesh(fine.vertices, fine.faces)
    found = surface.nearest(points, normals)
    a, b, c = (fine.vertices[corner] for corner in fine.faces[found.faces].T)
    weights = _barycentric(found.points, a, b, c)
    at = distance[found.faces]
    known = np.where(np.isfinite(at), at, 0.0)
    along = np.einsum("mk,mk->m", weights, known)
    along = np.where(np.isfinite(at).all(axis=1), along, np.inf)
    return np.where(found.distances <= 1e-6 * surface.size, along, 0.0)


def _barycentric(points: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Shares (m, 3) of the corners at points (m, 3) of triangles, not below 0."""
    crossed = np.cross(b - a, c - a)
    twice = np.maximum(np.einsum("ma,ma->m", crossed, crossed), 1e-300)
    parts = [
        np.einsum("ma,ma->m", np.cross(q - p, points - p), crossed) / twice
        for p, q in ((b, c), (c, a), (a, b))
    ]
    shares = np.clip(np.stack(parts, axis=1), 0.0, 1.0)
    return np.asarray(shares / np.maximum(shares.sum(axis=1, keepdims=True), 1e-300))
