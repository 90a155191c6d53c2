"""Where a tool has its clearance before an object's mesh, and regions without the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.units import readable
from nrdf.surface.fine_mesh import FineMesh, edges_of, refine
from nrdf.surface.mesh_cut import bisected, divided
from nrdf.surface.region_mesh import RegionMesh
from nrdf.surface.target_mesh import TargetMesh

Free = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Whether (m,) a tool may be at points (m, 3) of a surface with outward normals (m, 3)."""
_OFF = 1e-5  # of the object's size, from which a ray starts before the surface
_INSIDE = 0.5  # winding number
_HALVINGS, _PARTS = 6, 2.0  # steps to where clearance ends; edges along the tool's radius
_MOST_FACES = 60_000
_SLIT = 0.25  # tool radii: into a narrower slit no tool goes, whatever clearance it is given
_INWARD = 0.02  # share of the way to the faces around, at which a vertex is looked at


def needed_clearance(clearance_m: float, tool_radius_m: float) -> float:
    """What must be free before the surface where a tool works, m.

    Its clearance, and a quarter of its radius at least. The one rule of what a tool can access:
    planners, reports, simulation and benchmark ask `has_clearance` with it.
    """
    return max(clearance_m, _SLIT * tool_radius_m)


def has_clearance(
    mesh: TargetMesh, points: np.ndarray, normals: np.ndarray, clearance_m: float
) -> np.ndarray:
    """Whether (m,) nothing of the object stands within `clearance_m` before points (m, 3) on it.

    Looked at along the outward normals (m, 3). In a crevice between two parts, or beneath a part
    that lies on another, there is no clearance.
    """
    if clearance_m <= 0.0 or not len(points):
        return np.ones(len(points), bool)
    off = _OFF * mesh.size
    starts = points + off * normals
    distances, faces = mesh.first_hits(starts, normals)
    free = distances + off > clearance_m
    # A face met from behind: the ray starts inside a part, unless it came in by a hole.
    leaving = np.einsum("ma,ma->m", mesh.face_normals[faces], normals) > 0.0
    unsure = np.flatnonzero(free & (faces >= 0) & leaving)
    if len(unsure):
        free[unsure[mesh.winding_numbers(starts[unsure]) > _INSIDE]] = False
    return np.asarray(free)


def accessible_region(region: RegionMesh, clearance_m: float, tool_radius_m: float) -> RegionMesh:
    """A region without the places at which the tool lacks its clearance, cut within triangles.

    Whole for a tool without one: what no tool accesses, planners then leave out side by side.
    Raises ProcessError where that leaves nothing.
    """
    if clearance_m <= 0.0:
        return region

    def free(points: np.ndarray, outward: np.ndarray) -> np.ndarray:
        return has_clearance(region.parent, points, outward, clearance_m)

    key = clearance_m, tool_radius_m
    found = region.last(
        ("accessible", region.rough), key, lambda: region_where(region, free, tool_radius_m)
    )
    if found is None:
        raise ProcessError(
            f"the tool's clearance_m is {clearance_m:g}, and nowhere in the region are "
            f"{readable('clearance_m', clearance_m)} free before the surface; give less, or 0"
        )
    return found


def region_where(region: RegionMesh, free: Free, tool_radius_m: float) -> RegionMesh | None:
    """The part of a region where a tool may be, cut within triangles; None where it may nowhere."""
    own = region.mesh
    fine = refine(own.vertices, own.faces, tool_radius_m / _PARTS, most_faces=_MOST_FACES)
    normals = TargetMesh(fine.vertices, fine.faces).vertex_normals
    places = _drawn_in(fine)
    inside = free(places, normals)
    if inside.all():
        return region
    if not inside.any():
        return None

    # Where that ends on edges between a vertex at which it may be and one at which it may not.
    pairs, of_face = edges_of(fine.faces)
    change = np.flatnonzero(inside[pairs[:, 0]] != inside[pairs[:, 1]])
    ends = np.where(inside[pairs[change, :1]], pairs[change], pairs[change, ::-1])
    one, other = (places[ends[:, k]] for k in (0, 1))
    outward = unit_vectors(normals[ends[:, 0]] + normals[ends[:, 1]])
    way = bisected(one, other, lambda between: free(between, outward), _HALVINGS)
    share = np.full(len(pairs), np.nan)
    share[change] = np.where(inside[pairs[change, 0]], way, 1.0 - way)
    pieces, _ = divided(fine, pairs, of_face, share, np.zeros((len(fine.faces), 3, 0)))
    # Every piece has a vertex that was there before.
    given = np.concatenate([inside, np.zeros(len(pieces.vertices) - len(inside), bool)])
    left = pieces.part(given[pieces.faces].any(axis=1))
    return replace(region, mesh=TargetMesh(left.vertices, left.faces, own.repairs))


def _drawn_in(fine: FineMesh) -> np.ndarray:
    """The vertices (v, 3), a little nearer to the middles of the faces around: those of a border
    may lie in the plane of a wall, which a ray then meets or not by chance."""
    corner = fine.faces.reshape(-1)
    count = np.maximum(np.bincount(corner, minlength=len(fine.vertices)), 1)
    middles = np.repeat(fine.centres, 3, axis=0)
    sums = [np.bincount(corner, middles[:, a], len(fine.vertices)) for a in range(3)]
    return fine.vertices + _INWARD * (np.stack(sums, axis=1) / count[:, None] - fine.vertices)
