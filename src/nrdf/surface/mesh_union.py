"""Overlapping parts of an object as one surface: what lies inside another part is cut away."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

from nrdf.surface.mesh_sewing import (
    capped,
    crowded_edges_divided,
    paired_half_edges,
    part_numbers,
    sewn_borders,
    split_vertices,
    thickened,
)
from nrdf.surface.mesh_slivers import without_slivers

_CAP = 0.25  # of a part's area: holes that may be closed for telling inside from outside
_THIN = 2e-6  # longest sides that a sheet is thick, for it to be cut
_UNNAMED = 1 << 30  # numbers from here on are of faces that the mesh does not have
_MOST_PARTS = 2000  # of a mesh; one with more is left as it is


@dataclass(frozen=True)
class United:
    """vertices (v, 3), outward faces (f, 3) and the face (f,) that each is a piece of.
    covered: area that other parts covered, in the vertices' unit squared; parts: how many there
    were."""

    vertices: np.ndarray
    faces: np.ndarray
    origin: np.ndarray
    covered: float
    parts: int


def united(vertices: np.ndarray, faces: np.ndarray) -> United:
    """The outer surface of the union of a mesh's closed parts, and open ones outside of them.

    vertices: (v, 3); faces: (f, 3), outward. Parts with small holes count as closed. What lies
    inside a closed part is removed, exactly where the surfaces cross; parts that touch become one.
    """
    given = United(vertices, faces, np.arange(len(faces)), 0.0, 0)
    vertices, faces, origin = sewn_borders(vertices, faces)
    vertices, faces, source = crowded_edges_divided(vertices, faces)
    origin = origin[source]
    solids, sheets, left = _bodies(vertices, faces)
    if not solids or len(solids) + len(sheets) < 2:
        return given
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    pieces = [_triangles(body) for body in (union, *(sheet - union for sheet in sheets))]
    pieces.append((vertices, faces[left], left))
    shift = np.cumsum([0, *(len(piece[0]) for piece in pieces[:-1])])
    vertices = np.concatenate([piece[0] for piece in pieces])
    faces = np.concatenate([piece[1] + by for piece, by in zip(pieces, shift, strict=True)])
    origin = origin[np.concatenate([piece[2] for piece in pieces])]
    vertices, faces, origin = without_slivers(vertices, faces, origin)
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    covered = _area(given.vertices, given.faces) - _area(vertices, faces)
    return United(vertices, faces, origin, max(covered, 0.0), len(solids) + len(sheets))


def _bodies(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[list[manifold3d.Manifold], list[manifold3d.Manifold], np.ndarray]:
    """The parts of a mesh that are closed and those that are open, the latter with a back, their
    triangles named by their faces; and the faces (k,) of parts that are neither."""
    opposite = paired_half_edges(vertices, faces)
    part = part_numbers(opposite)
    split, place = split_vertices(faces, opposite)
    count = int(part.max()) + 1
    order = np.argsort(part, kind="stable")
    if not 1 < count <= _MOST_PARTS:
        return [], [], order
    solids: list[manifold3d.Manifold] = []
    sheets: list[manifold3d.Manifold] = []
    left = [np.zeros(0, np.int64)]
    is_open = np.zeros(count, bool)
    is_open[part[np.flatnonzero(opposite < 0) // 3]] = True
    thin = _THIN * float(np.ptp(vertices, axis=0).max())
    for number, own in enumerate(np.split(order, np.cumsum(np.bincount(part))[:-1])):
        used, local = np.unique(split[own], return_inverse=True)
        places, local = vertices[place[used]], local.reshape(-1, 3)
        closed = capped(places, local, _CAP) if is_open[number] else (places, local)
        shape = closed or thickened(places, local, thin)
        body = _manifold(shape[0], shape[1], own)
        if body is None or body.volume() < 0.0:
            left.append(own)
        else:
            (solids if closed else sheets).append(body)
    return solids, sheets, np.concatenate(left)


def _manifold(
    vertices: np.ndarray, faces: np.ndarray, name: np.ndarray
) -> manifold3d.Manifold | None:
    """A body of faces (f, 3), the first of them with a name (k,); None if it is not closed."""
    # Faces of one number count as flat and are merged, so all others get one, too.
    number = np.concatenate([name, _UNNAMED + np.arange(len(faces) - len(name))])
    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(vertices),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
        face_id=number.astype(np.uint64),
    )
    body = manifold3d.Manifold(mesh)
    return body if body.status() == manifold3d.Error.NoError else None


def _triangles(body: manifold3d.Manifold) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces with a name, and their names."""
    mesh = body.to_mesh64()
    faces = np.asarray(mesh.tri_verts).reshape(-1, 3).astype(np.int64)
    name = np.asarray(mesh.face_id).astype(np.int64)
    vertices = np.asarray(mesh.vert_properties, np.float64)[:, :3].copy()
    # Vertices that are doubled for their properties are one.
    merged = np.arange(len(vertices))
    merged[np.asarray(mesh.merge_from_vert, np.int64)] = np.asarray(mesh.merge_to_vert, np.int64)
    named = name < _UNNAMED
    return vertices, merged[faces[named]], name[named]


def _area(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[corner] for corner in faces.T)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0
