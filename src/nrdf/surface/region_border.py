"""Where a region ends on a mesh: votes of points become a smooth function, and its level set."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
from scipy.sparse import csc_matrix, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.winding import mesh_winding_numbers
from nrdf.surface.mesh_cut import FineMesh, bisected, cut, refine
from nrdf.surface.mesh_edges import edge_components
from nrdf.surface.target_mesh import TargetMesh

LEVEL = 0.5
"""Membership at a region's border."""
_VOTES, _SIDE = 6, 4.0  # votes that count at a place; spacings that opposite normals are apart
_FAR = 4.0  # spacings from where a vote says nothing
_SMOOTHING = 1.5  # spacings of votes that heat spreads over, at least
_OF_RADIUS = 0.35  # of the tool that heat spreads over, at least
_EDGE = 1.5  # edges of the fine mesh along that way
_MOST_FACES = 120_000
_MOST_PARTS = 200  # each of which is asked for what it covers
_OFF, _INSIDE, _HALVINGS = 1e-4, 0.6, 5  # as of `mesh_repair`, and steps to the place of a change


@dataclass(frozen=True)
class Votes:
    """Points (n, 3), m, with outward normals (n, 3), and how much (n,) each belongs to a region, 0
    to 1. spacing: typical distance between the points, m."""

    points: np.ndarray
    normals: np.ndarray
    membership: np.ndarray
    spacing: float

    @staticmethod
    def checked(points: np.ndarray, normals: np.ndarray, membership: np.ndarray) -> Votes:
        """Raises ProcessError for arrays that do not fit each other, and shares that are none."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        normals = np.asarray(normals, dtype=np.float64)
        membership = np.asarray(membership, dtype=np.float64)
        if points.ndim != 2 or points.shape[1:] != (3,) or normals.shape != points.shape:
            raise ProcessError(f"points {points.shape} and normals {normals.shape} must be (n, 3)")
        if membership.shape != points.shape[:1] or len(points) < 8:
            raise ProcessError(
                f"a region needs the membership (n,) of at least 8 points, not "
                f"{membership.shape} of {len(points)}"
            )
        if not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise ProcessError("the points of a region must be finite")
        if not ((membership >= 0.0) & (membership <= 1.0)).all():
            raise ProcessError("a membership is 0 to 1")
        if not (membership > LEVEL).any():
            raise ProcessError("no point belongs to the region by more than a half")
        away = cKDTree(points).query(points, [8])[0][:, 0]
        spacing = float(np.median(away) * np.sqrt(np.pi / 7.0))
        return Votes(points, unit_vectors(normals), membership, max(spacing, 1e-9))

    def at(self, places: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Membership (m,) at places (m, 3) of a side, normals (m, 3), and how well it is known
        (m,), 0 to 1: not at all where no vote of that side is around."""
        apart = _SIDE * self.spacing / 2.0
        tree = cKDTree(np.hstack([self.points, apart * self.normals]))
        count = min(_VOTES, len(self.points))
        away, near = tree.query(np.hstack([places, apart * normals]), count)
        near = near.reshape(len(places), -1)
        weight = np.exp(-((away.reshape(near.shape) / self.spacing) ** 2))
        weight = np.maximum(weight, 1e-30)
        known = np.clip(_FAR - away.reshape(near.shape)[:, 0] / self.spacing, 1e-4, 1.0)
        return (weight * self.membership[near]).sum(axis=1) / weight.sum(axis=1), known


def cut_at_border(
    target: TargetMesh, votes: Votes, tool_radius_m: float, whole: bool = False
) -> tuple[FineMesh, np.ndarray]:
    """The target's faces around a region, fine and cut where it ends, and which (f,) it has.

    whole: all other faces of the target, too. Faces covered by other parts of the object are left
    out. The votes are spread by heat over the mesh, for a time that takes it some spacings of the
    points and a part of the tool's radius far.
    """
    reach = max(_SMOOTHING * votes.spacing, _OF_RADIUS * tool_radius_m)
    fine = _fine_around(target, votes, reach, whole)
    fine = _uncovered(target, fine)
    share = smooth_membership(target, fine, votes, reach)

    def crossing(ends: np.ndarray) -> np.ndarray:
        inner, outer = share[ends[:, 0]], share[ends[:, 1]]
        return np.asarray((inner - LEVEL) / np.maximum(inner - outer, 1e-12))

    return cut(fine, share > LEVEL, crossing)


def _fine_around(target: TargetMesh, votes: Votes, reach: float, whole: bool) -> FineMesh:
    belonging = cKDTree(votes.points[votes.membership > 0.2 * LEVEL])
    given = FineMesh(target.vertices, target.faces, np.arange(len(target.faces)))
    margin = 2.0 * reach + 3.0 * votes.spacing

    def wanted(middles: np.ndarray, radii: np.ndarray) -> np.ndarray:
        reach = radii + margin
        away = belonging.query(middles, distance_upper_bound=reach.max(initial=0.0))[0]
        return np.asarray(away < reach)

    area = belonging.n / len(votes.points) * float(target.face_areas.sum())
    edge = max(reach / _EDGE, float(np.sqrt(8.0 * area / _MOST_FACES)))
    fine = refine(given, edge, wanted, _MOST_FACES + 2 * len(target.faces))
    return fine if whole else fine.of_faces(wanted(fine.middles, fine.radii))


def _uncovered(target: TargetMesh, fine: FineMesh) -> FineMesh:
    """Without what lies inside other parts of the object, cut where it dives into them."""
    above = _OFF * target.size
    normals = igl.per_vertex_normals(fine.vertices, fine.faces)
    normals = unit_vectors(np.nan_to_num(np.asarray(normals)))

    def covered(places: np.ndarray) -> np.ndarray:
        return mesh_winding_numbers(target.vertices, target.faces, places) > _INSIDE

    lifted = fine.vertices + above * normals
    hidden = _amid_other_parts(target, fine)
    hidden[hidden] = covered(lifted[hidden])
    if not hidden.any():
        return fine

    def crossing(ends: np.ndarray) -> np.ndarray:
        starts, stops = (fine.vertices[ends[:, k]] for k in (0, 1))
        lift = above * unit_vectors(normals[ends[:, 0]] + normals[ends[:, 1]])
        return bisected(starts + lift, stops + lift, covered, _HALVINGS)

    pieces, inside = cut(fine, hidden, crossing)
    if inside.all():
        return fine
    return pieces.of_faces(~inside)


def _amid_other_parts(target: TargetMesh, fine: FineMesh) -> np.ndarray:
    """Which vertices (v,) are within the bounding box of a part that they do not belong to."""
    part = edge_components(target.faces)
    count = int(part.max()) + 1
    corners = target.vertices[target.faces]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    own = np.zeros(len(fine.vertices), np.int64)
    own[fine.faces] = part[fine.origin][:, None]
    amid = np.zeros(len(fine.vertices), bool)
    for number in range(count if count <= _MOST_PARTS else 0):
        others = np.flatnonzero(~amid & (own != number))
        places = fine.vertices[others]
        amid[others] = ((places >= low[number]) & (places <= high[number])).all(axis=1)
    return amid if count <= _MOST_PARTS else ~amid


def smooth_membership(target: TargetMesh, fine: FineMesh, votes: Votes, reach: float) -> np.ndarray:
    """Membership (v,) at the vertices of a fine mesh: the votes, spread by heat over its faces.

    One implicit step of the heat equation, for the time that takes heat `reach` far (m), on the
    cotangent Laplacian of the intrinsic Delaunay triangulation. Where votes are missing, those
    around flow in.
    """
    seen, known = votes.at(fine.middles, target.face_normals[fine.origin])
    count = len(fine.vertices)
    part = fine.areas / 3.0
    corner = fine.faces.reshape(-1)
    mass = np.bincount(corner, np.repeat(part * known, 3), count)
    heat = np.bincount(corner, np.repeat(part * known * seen, 3), count)
    laplacian = igl.cotmatrix(fine.vertices, fine.faces)
    system = csc_matrix(diags_array(mass + 1e-9 * part.mean()) - reach**2 * laplacian)
    # Symmetric and positive, so that nothing need be swapped.
    options = {"SymmetricMode": True}
    found = splu(system, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve(heat)
    return np.clip(found, 0.0, 1.0)
