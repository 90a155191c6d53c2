"""Where the mesh of a scan ends: gaps between points closed, holes open, ends even."""

from __future__ import annotations

import numpy as np

from nrdf.surface.mesh_edges import boundary_loops, edge_components, opposite_half_edges

_PAST = 0.9  # spacings from the nearest point: farther parts that touch an end are no surface
_TRIMMED, _RINGS = 0.6, 3  # the same for faces taken away at the end, and rings of them
_END = 0.2  # spacings past the last point that the surface ends
_EVENED = 3  # rounds of averaging along the ends
_SMALL = 1.5  # squares of a spacing, of folds that make no end
_AROUND = 5.0  # spacings around a hole that is closed


def trimmed(
    faces: np.ndarray, outward: np.ndarray, past: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """The faces (f, 3) that are surface.

    outward: (f,), whether a face looks as the points beside it do. past: (v,), distance of a vertex
    to the nearest point along the surface, in spacings. area: (f,), in squares of a spacing. What
    is far from all points stays if it lies amid the surface, as a gap between points does; it goes
    if it lies at an end. Small folds amid the surface make no end, though they go.
    """
    near = (past <= _PAST)[faces].all(axis=1)
    kept = _closed(faces, outward, area, near)
    loose = kept & (past > _PAST)[faces].any(axis=1)
    part = edge_components(faces, loose)
    at_end = np.zeros(int(part.max(initial=-1)) + 1, bool)
    at_end[part[loose & _open(faces, kept)]] = True
    kept &= ~(loose & at_end[part])
    far = past > _TRIMMED
    for _ in range(_RINGS):
        end = np.zeros(len(past), bool)
        end[end_edges(faces[kept])] = True
        loose = kept & (end & far)[faces].any(axis=1)
        if not loose.any():
            break
        kept &= ~loose
    return faces[kept & outward]


def closed(
    vertices: np.ndarray, faces: np.ndarray, spacing: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3), m, and faces (f, 3) with holes that a gap between points can be closed by
    faces around their middle. spacing: (v,), m, at each vertex of the mesh that is given."""
    middles: list[np.ndarray] = []
    more = [faces]
    for loop in boundary_loops(faces):
        corners = vertices[loop]
        around = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).sum()
        if around > _AROUND * spacing[loop].mean():
            continue
        if len(loop) == 3:
            more.append(loop[None, ::-1])
            continue
        middle = np.full(len(loop), len(vertices) + len(middles))
        middles.append(corners.mean(axis=0))
        more.append(np.stack([np.roll(loop, -1), loop, middle], axis=1))
    return np.concatenate([vertices, *(m[None] for m in middles)]), np.concatenate(more)


def even_ends(
    vertices: np.ndarray,
    faces: np.ndarray,
    points: np.ndarray,
    normals: np.ndarray,
    spacing: np.ndarray,
) -> np.ndarray:
    """Vertices (v, 3) of which those at ends lie on even lines, near the surface's last points.

    points, normals: (v, 3), the point of the scan nearest to each vertex, and its normal;
    spacing: (v,), m, there.
    """
    edges = end_edges(faces)
    if not len(edges):
        return vertices
    vertices = vertices.copy()
    count = np.bincount(edges.reshape(-1), minlength=len(vertices))
    at_end, simple = np.flatnonzero(count), np.flatnonzero(count == 2)
    for _ in range(_EVENED):
        total = np.zeros_like(vertices)
        np.add.at(total, edges[:, 0], vertices[edges[:, 1]])
        np.add.at(total, edges[:, 1], vertices[edges[:, 0]])
        vertices[simple] = 0.5 * vertices[simple] + 0.25 * total[simple]
    offset = vertices[at_end] - points[at_end]
    height = np.einsum("va,va->v", offset, normals[at_end])[:, None] * normals[at_end]
    along = offset - height
    length = np.linalg.norm(along, axis=1)
    share = np.minimum(1.0, _END * spacing[at_end] / np.maximum(length, 1e-12))[:, None]
    vertices[at_end] = points[at_end] + share * along + share**2 * height
    return vertices


def end_edges(faces: np.ndarray) -> np.ndarray:
    """Vertices (e, 2) of the edges that one face alone has."""
    edge = np.flatnonzero(opposite_half_edges(faces) < 0)
    tail, head = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    return np.stack([tail[edge], head[edge]], axis=1)


def _closed(faces: np.ndarray, kept: np.ndarray, area: np.ndarray, near: np.ndarray) -> np.ndarray:
    """`kept` (f,) with the small parts of the rest that it encloses."""
    part = edge_components(faces, kept)
    count = int(part.max(initial=-1)) + 1
    small = np.bincount(part, area, count) < _SMALL
    small[part[~near & ~kept]] = False
    small[part[(opposite_half_edges(faces) < 0).reshape(-1, 3).any(axis=1)]] = False
    return np.asarray(kept | small[part])


def _open(faces: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Which of the kept faces (f,) lie at an end of what is kept."""
    found = np.zeros(len(faces), bool)
    found[kept] = (opposite_half_edges(faces[kept]) < 0).reshape(-1, 3).any(axis=1)
    return found
