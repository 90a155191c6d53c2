"""Where regions end on a mesh: votes of points become smooth functions, and their level sets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import igl
import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import unit_vectors
from nrdf.surface.fine_mesh import FineMesh, refine
from nrdf.surface.mesh_cut import cut
from nrdf.surface.mesh_edges import opposite_half_edges
from nrdf.surface.mesh_sewing import split_vertices
from nrdf.surface.target_mesh import TargetMesh

LEVEL = 0.5
"""Membership at a region's border."""
_SMOOTHING = 1.5  # spacings of votes that heat spreads over, at least
_OF_RADIUS = 0.35  # of the tool that heat spreads over, at least
_EDGE, _OF_TOOL = 1.5, 0.45  # edges of the fine mesh along that way, and tool's radii of an edge
_MOST_FACES = 100_000
_CREASE, _ACROSS = 0.6, 0.05  # cosine between its faces; conductance across it for each vertex
_CROWDED = 0.3  # of the spacing that points have if they lie evenly, at least
_SIDE = 4.0  # spacings that opposite normals are apart
_FAR = 2.0  # spacings from the middles of faces, from where a vote says nothing
_STEEPEST = 30.0  # cotangent: thinner triangles conduct no better
_HELD = 1e-9  # share of the diagonal that is added to it


@dataclass(frozen=True)
class Votes:
    """Points (n, 3), m, with outward normals (n, 3), and how much each belongs to each region,
    membership (n, r), 0 to 1. spacing: typical distance between the points, m."""

    points: np.ndarray
    normals: np.ndarray
    membership: np.ndarray
    spacing: float

    @staticmethod
    def checked(
        points: np.ndarray, normals: np.ndarray, memberships: Mapping[str, np.ndarray]
    ) -> Votes:
        """Raises ProcessError for arrays that do not fit each other, and shares that are none."""
        points = np.ascontiguousarray(points, dtype=np.float64)
        normals = np.asarray(normals, dtype=np.float64)
        if points.ndim != 2 or points.shape[1:] != (3,) or normals.shape != points.shape:
            raise ProcessError(f"points {points.shape} and normals {normals.shape} must be (n, 3)")
        shares = []
        for name, given in memberships.items():
            share = np.asarray(given, dtype=np.float64)
            if share.shape != points.shape[:1] or len(points) < 8:
                raise ProcessError(
                    f"{name}: a region needs the membership (n,) of at least 8 points, not "
                    f"{share.shape} of {len(points)}"
                )
            if not ((share >= 0.0) & (share <= 1.0)).all():
                raise ProcessError(f"{name}: a membership is 0 to 1")
            shares.append(share)
        if not (np.isfinite(points).all() and np.isfinite(normals).all()):
            raise ProcessError("the points of a region must be finite")
        away = cKDTree(points).query(points, [8])[0][:, 0]
        spacing = float(np.median(away) * np.sqrt(np.pi / 7.0))
        membership = np.stack(shares, axis=1) if shares else np.zeros((len(points), 0))
        return Votes(points, unit_vectors(normals), membership, max(spacing, 1e-9))


@dataclass(frozen=True)
class CutObject:
    """A whole object in fine triangles, cut along the borders of its regions.

    inside: (r, f) bool, the faces of each region. given_away: (r,) area, m², that votes gave to
    a region and that another one has.
    """

    mesh: FineMesh
    inside: np.ndarray
    given_away: np.ndarray


def cut_at_borders(
    target: TargetMesh, votes: Votes, tool_radius_m: float, allow_overlap: bool = False
) -> CutObject:
    """The target in fine triangles, cut where its regions end.

    The votes are spread by heat over the mesh, for a time that takes it some spacings of the points
    and a part of the tool's radius far. Unless regions may overlap, each place belongs to the
    region with the largest membership there.
    """
    # Points that are given more than once say nothing of their spacing.
    even = float(np.sqrt(target.face_areas.sum() / len(votes.points)))
    votes = replace(votes, spacing=max(votes.spacing, _CROWDED * even))
    reach = max(_SMOOTHING * votes.spacing, _OF_RADIUS * tool_radius_m)
    edge = min(reach / _EDGE, _OF_TOOL * tool_radius_m)
    fine = refine(target.vertices, target.faces, edge, most_faces=_MOST_FACES)
    values = smooth_memberships(fine, votes, reach)
    count = values.shape[2]
    for number in range(count):
        fine, values = cut(fine, _level(values, number, allow_overlap), values)
    # Each face is on one side of every border now, up to rounding.
    middle = values.mean(axis=1)
    inside = np.array([_level(middle, number, allow_overlap) > 0.0 for number in range(count)])
    areas = fine.areas
    given_away = np.array([areas[(middle[:, k] > LEVEL) & ~inside[k]].sum() for k in range(count)])
    return CutObject(fine, inside, given_away)


def _level(values: np.ndarray, number: int, allow_overlap: bool) -> np.ndarray:
    """A function of memberships (..., r) that is positive inside a region."""
    own = values[..., number]
    level = own - LEVEL
    if not allow_overlap:
        # Where the region has no say, others have none in it.
        there = (level > 0.0).any(axis=tuple(range(1, level.ndim)))
        for other in range(values.shape[-1]):
            if other != number:
                level[there] = np.minimum(level[there], own[there] - values[there, ..., other])
    return np.asarray(level)


def smooth_memberships(fine: FineMesh, votes: Votes, reach: float) -> np.ndarray:
    """Memberships (f, 3, r) at the corners of a fine mesh: the votes, spread by heat over it.

    One implicit step of the heat equation, for the time that takes heat `reach` far (m), from the
    places of the votes on the mesh. Where there are none, those around flow in. Hardly any heat
    crosses a crease, so the corners of the faces on its two sides may differ: regions end there
    rather than beside it.
    """
    opposite = opposite_half_edges(fine.faces)
    creases = _creases(fine, opposite)
    flat = opposite.copy()
    flat[creases] = -1
    corners, place = split_vertices(fine.faces, flat)
    count = len(place)
    smooth = FineMesh(fine.vertices[place], corners, fine.origin, fine.edge_m)
    name = corners.ravel()
    links = (name[creases], name[opposite[creases] // 3 * 3 + (opposite[creases] + 1) % 3])
    bridge = csr_matrix((np.full(len(creases), _ACROSS), links), (count, count))
    bridge = bridge + bridge.T
    bridge = csr_matrix(diags_array(np.asarray(bridge.sum(axis=1)).ravel()) - bridge)
    corner, share, told = _places(smooth, votes)
    row = np.arange(len(corner))[:, None].repeat(3, axis=1)
    at = csr_matrix((share.ravel(), (row.ravel(), corner.ravel())), (len(corner), count))
    weight = votes.spacing**2
    system = csr_matrix(weight * (at.T @ at) + reach**2 * (_conductance(smooth) + bridge))
    heat = weight * (at.T @ votes.membership[told])
    found = np.clip(_solved(system, heat), 0.0, 1.0)
    return np.asarray(found[corners])


def _creases(fine: FineMesh, opposite: np.ndarray) -> np.ndarray:
    """Half-edges (k,) between faces that meet at an angle."""
    half = np.flatnonzero(opposite >= 0)
    facing = np.einsum("ea,ea->e", fine.normals[half // 3], fine.normals[opposite[half] // 3])
    return half[facing < _CREASE]


def _places(fine: FineMesh, votes: Votes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (k, 3) of the faces that votes lie on, their shares (k, 3) of the place, and which
    votes (k,) those are: all that lie near a face of their side."""
    apart = _SIDE * votes.spacing / 2.0
    tree = cKDTree(np.hstack([fine.centres, apart * fine.normals]))
    away, face = tree.query(
        np.hstack([votes.points, apart * votes.normals]),
        distance_upper_bound=_FAR * votes.spacing + fine.edge_m,
    )
    told = np.flatnonzero(np.isfinite(away))
    face = face[told]
    a, b, c = (fine.vertices[fine.faces[face, k]] for k in range(3))
    shares = np.asarray(igl.barycentric_coordinates(votes.points[told], a, b, c))
    shares = np.clip(np.nan_to_num(shares, nan=1.0 / 3.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    shares /= np.maximum(shares.sum(axis=1, keepdims=True), 1e-12)
    return fine.faces[face], shares, told


def _conductance(fine: FineMesh) -> csr_matrix:
    """Cotangent matrix (v, v), positive semi-definite; no edge conducts negatively or much better
    than others, however thin its triangles are."""
    corners = fine.vertices[fine.faces]
    one = np.roll(corners, -1, axis=1) - corners
    two = np.roll(corners, -2, axis=1) - corners
    double = np.linalg.norm(np.cross(one[:, 0], two[:, 0]), axis=1)
    cotangent = np.einsum("fka,fka->fk", one, two) / np.maximum(double, 1e-300)[:, None]
    half = 0.5 * np.clip(cotangent, -_STEEPEST, _STEEPEST)
    # The angle at a corner is that of the edge across.
    tail = np.roll(fine.faces, -1, axis=1).ravel()
    head = np.roll(fine.faces, -2, axis=1).ravel()
    count = len(fine.vertices)
    joined = csr_matrix(
        (np.tile(half.ravel(), 2), (np.concatenate([tail, head]), np.concatenate([head, tail]))),
        (count, count),
    )
    joined.sum_duplicates()
    joined.data = np.clip(joined.data, 1e-3, _STEEPEST)
    return csr_matrix(diags_array(np.asarray(joined.sum(axis=1)).ravel()) - joined)


def _solved(system: csr_matrix, right: np.ndarray) -> np.ndarray:
    """Solution (v, r) of a symmetric positive system; 0 where nothing is said."""
    # Parts without votes have no solution of their own.
    held = _HELD * float(system.diagonal().mean()) * np.ones(system.shape[0])
    symmetric = {"SymmetricMode": True}
    factors = splu(
        csc_matrix(system + diags_array(held)), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options=symmetric,
    )  # fmt: skip
    return np.asarray(factors.solve(right))
