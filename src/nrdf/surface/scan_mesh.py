"""A scan as a mesh to plan on: noise smoothed away, holes open, the sides of thin sheets apart."""

from __future__ import annotations

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.errors import ProcessError
from nrdf.geometry.frames import tangent_frames, unit_vectors
from nrdf.geometry.quadrics import quadrics
from nrdf.surface.mesh_edges import edge_components, opposite_half_edges
from nrdf.surface.target_mesh import TargetMesh

_LEAST_POINTS = 50
_FINEST, _MOST_CELLS = 0.75, 4_000_000  # of a point spacing; of the grid
_FITTED = 36  # points that a quadric is fitted to
_NEAREST = 8  # fitted points that the distance at a place comes from
_ALIKE, _AGAINST = 0.3, -0.3  # cosines between normals of one side, and of two
_BAND = 1  # cells around each point that the surface is looked for in
_GAP = 1.8  # spacings from the nearest point that a face may be
_PAST, _PEELS = 0.55, 4  # the same at the surface's end, and rings of faces taken away to get there
_LEAST_FACES = 24  # of a piece: smaller ones are noise
_AT_ONCE = 1 << 15
_CORNERS = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)


def mesh_from_scan(points: np.ndarray, normals: np.ndarray, edge_m: float) -> TargetMesh:
    """The surface through the points of a scan, in triangles with edges of about `edge_m`.

    points: (n, 3), m; normals: (n, 3), towards where they were seen from. Each point is moved onto
    a quadric through those around it; the surface is where the signed distance to their tangent
    planes is 0 (implicit moving least squares, Kolluri 2005), found by marching cubes in a narrow
    band. It ends where no point is near. Edges are not made finer than three quarters of the
    distance between points. Raises ProcessError for arrays that do not fit each other, too few
    points, or an edge that the scan is too large for.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    normals = np.asarray(normals, dtype=np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or normals.shape != points.shape:
        raise ProcessError(f"points {points.shape} and normals {normals.shape} must be (n, 3)")
    if len(points) < _LEAST_POINTS:
        raise ProcessError(f"a surface needs at least {_LEAST_POINTS} points, not {len(points)}")
    if not (np.isfinite(points).all() and np.isfinite(normals).all()):
        raise ProcessError("the points of a scan and their normals must be finite")
    if not (np.isfinite(edge_m) and edge_m > 0.0):
        raise ProcessError(f"the edge of a mesh must be above 0 m, not {edge_m:g}")
    points, normals = _thinned(points, unit_vectors(normals), edge_m / 2.0)
    points, normals, spacing = _smoothed(points, normals)
    cell = max(edge_m, _FINEST * float(np.median(spacing)))
    vertices, faces = [], []
    count = 0
    for chosen in _sides(points, normals, 2.5 * cell):
        found = _zero_surface(points[chosen], normals[chosen], spacing[chosen], cell)
        vertices.append(found[0])
        faces.append(found[1] + count)
        count += len(found[0])
    every = np.concatenate(faces)
    if not len(every):
        raise ProcessError("no surface goes through the points of the scan: they are too scattered")
    number = edge_components(every)
    large = np.bincount(number) >= min(_LEAST_FACES, np.bincount(number).max())
    mesh = TargetMesh(np.concatenate(vertices), every)
    return mesh.submesh(large[number])


def _thinned(points: np.ndarray, normals: np.ndarray, cell: float) -> tuple[np.ndarray, np.ndarray]:
    """Points of one cell and one side brought together at their middle."""
    place = np.floor((points - points.min(axis=0)) / cell)
    if place.max() > 1 << 19:
        raise ProcessError("the scan is too large for a mesh as fine as this; take a longer edge")
    key = place.astype(np.int64) @ np.array([1 << 40, 1 << 20, 1])
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (normals[np.arange(len(normals)), axis] > 0.0)
    # Cells first, sides within them: one number would not hold both.
    key = np.unique(key, return_inverse=True)[1] * 6 + side
    _, number, count = np.unique(key, return_inverse=True, return_counts=True)
    mean = [np.bincount(number, points[:, a]) / count for a in range(3)]
    total = [np.bincount(number, normals[:, a]) for a in range(3)]
    return np.stack(mean, axis=1), unit_vectors(np.stack(total, axis=1))


def _smoothed(points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points moved onto the quadric through those around of their side, its normals there, and the
    distance (n,) between points around each."""
    tree = cKDTree(points)
    count = min(_FITTED, len(points))
    moved, turned, spacing = points.copy(), normals.copy(), np.empty(len(points))
    for start in range(0, len(points), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        away, near = tree.query(points[part], count)
        facing = np.einsum("nka,na->nk", normals[near], normals[part])
        reach = 1.02 * away[:, -1:] + 1e-12
        weight = np.maximum(facing - _ALIKE, 0.0) * (1.0 - (away / reach) ** 2) ** 2
        outward = unit_vectors(np.einsum("nk,nka->na", weight, normals[near]))
        frame = tangent_frames(outward)
        offset = (points[near] - points[part][:, None]) @ frame.transpose(0, 2, 1)
        flat = offset[..., :2] / reach[..., None]
        found = quadrics(flat, offset[..., 2:], weight)[:, :, 0]
        enough = ((weight > 0.0).sum(axis=1) >= 8)[:, None]
        limit = reach / 2.0
        height = np.where(enough, np.clip(found[:, :1], -limit, limit), 0.0)
        slope = np.where(enough, np.clip(found[:, 1:3] / reach, -1.0, 1.0), 0.0)
        moved[part] += height * outward
        turned[part] = unit_vectors(outward - np.einsum("na,nab->nb", slope, frame[:, :2]))
        same = np.maximum((facing > _ALIKE).sum(axis=1), 1)
        spacing[part] = away[:, -1] * np.sqrt(np.pi / same)
    return moved, turned, np.minimum(spacing, 4.0 * np.median(spacing))


def _sides(points: np.ndarray, normals: np.ndarray, thickness: float) -> list[np.ndarray]:
    """The points in one or two sets of indices, in which no two opposite sides lie so near."""
    tree = cKDTree(points)
    # Half the thickness below a point of a thin sheet, the nearest one is of the other side.
    near = tree.query(points - thickness / 2.0 * normals, min(4, len(points)))[1]
    against = np.einsum("nka,na->nk", normals[near], normals) < _AGAINST
    against &= np.linalg.norm(points[near] - points[:, None], axis=2) < thickness
    amid = against.any(axis=1)
    if amid.mean() < 1e-4:
        return [np.arange(len(points))]
    # Thin sheets, each with a direction that tells its sides.
    amid[near[against]] = True
    chosen = np.flatnonzero(amid)
    away, near = cKDTree(points[chosen]).query(points[chosen], min(8, len(chosen)))
    row, column = np.nonzero(away < thickness)
    links = coo_matrix(
        (np.ones(len(row), bool), (row, near[row, column])), (len(chosen), len(chosen))
    )
    sheet = connected_components(links, directed=False)[1]
    count = int(sheet.max()) + 1
    scatter = np.zeros((count, 3, 3))
    np.add.at(scatter, sheet, normals[chosen][:, :, None] * normals[chosen][:, None])
    axis = np.linalg.eigh(scatter)[1][:, :, 2]
    back = np.zeros(len(points), bool)
    back[chosen] = np.einsum("na,na->n", normals[chosen], axis[sheet]) < 0.0
    # Points that this missed go with those beside them.
    rest = np.flatnonzero(~amid)
    placed = np.hstack([points, thickness * normals])
    off, beside = cKDTree(placed[chosen]).query(placed[rest], distance_upper_bound=thickness / 2.0)
    found = np.isfinite(off)
    back[rest[found]] = back[chosen[beside[found]]]
    return [np.flatnonzero(~back), np.flatnonzero(back)]


def _zero_surface(
    points: np.ndarray, normals: np.ndarray, spacing: np.ndarray, cell: float
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces where the signed distance to the points' planes is 0."""
    if not len(points):
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    origin = points.min(axis=0) - 4.371 * cell  # flat sides then miss the corners of cells
    around = np.stack(np.meshgrid(*[np.arange(-_BAND, _BAND + 1)] * 3), axis=-1).reshape(-1, 3)
    code = np.array([1 << 42, 1 << 21, 1])
    own = np.unique(np.floor((points - origin) / cell).astype(np.int64) @ code)
    cells = np.unique((own[:, None] + around @ code).reshape(-1))
    if len(cells) > _MOST_CELLS:
        raise ProcessError("the scan is too large for a mesh as fine as this; take a longer edge")
    corners, index = np.unique((cells[:, None] + _CORNERS @ code).reshape(-1), return_inverse=True)
    place = np.stack([corners >> 42, (corners >> 21) & 0x1FFFFF, corners & 0x1FFFFF], axis=1)
    places = origin + cell * place
    tree = cKDTree(points)
    distance = np.empty(len(places))
    for start in range(0, len(places), _AT_ONCE):
        part = slice(start, start + _AT_ONCE)
        away, near = tree.query(places[part], min(_NEAREST, len(points)))
        near = near.reshape(len(away), -1)
        width = (
            np.maximum(spacing[near[:, :1]], 0.75 * cell) + 0.5 * away.reshape(near.shape)[:, :1]
        )
        weight = np.exp(-((away.reshape(near.shape) / width) ** 2)) + 1e-30
        facing = np.einsum("nka,na->nk", normals[near], normals[near[:, 0]])
        weight *= np.maximum(facing, 0.0)
        height = np.einsum("nka,nka->nk", places[part][:, None] - points[near], normals[near])
        distance[part] = (weight * height).sum(axis=1) / weight.sum(axis=1)
    vertices, faces = igl.marching_cubes(
        distance, places, np.ascontiguousarray(index.reshape(-1, 8)), 0.0
    )[:2]
    vertices, faces = np.asarray(vertices), np.asarray(faces)
    if not len(faces):
        return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
    a, b, c = (vertices[corner] for corner in faces.T)
    cross = np.cross(b - a, c - a)
    away, near = tree.query((a + b + c) / 3.0)
    facing = np.einsum("fa,fa->f", unit_vectors(cross), normals[near])
    kept = away < _GAP * np.maximum(spacing[near], 0.5 * cell)
    kept &= (facing > 0.0) & (np.linalg.norm(cross, axis=1) > 1e-9 * cell**2)
    faces = faces[kept]
    away, near = tree.query(vertices)
    past = away > _PAST * np.maximum(spacing[near], 0.5 * cell)
    for _ in range(_PEELS):
        border = np.zeros(len(vertices), bool)
        open_edge = opposite_half_edges(faces) < 0
        border[faces.reshape(-1)[open_edge]] = True
        border[np.roll(faces, -1, axis=1).reshape(-1)[open_edge]] = True
        loose = (border & past)[faces].any(axis=1)
        if not loose.any():
            break
        faces = faces[~loose]
    return vertices, faces
