"""Overlapping parts of an object as one surface: what lies inside another part is cut away."""

from __future__ import annotations

from dataclasses import dataclass, replace

import igl
import manifold3d
import numpy as np

from nrdf.geometry.mesh import triangle_areas
from nrdf.surface.mesh_sewing import (
    capped,
    crowded_edges_divided,
    each_once,
    paired_half_edges,
    part_numbers,
    sewn_borders,
    split_vertices,
    thickened,
)
from nrdf.surface.mesh_sight import Seen
from nrdf.surface.mesh_slivers import without_slivers

_CAP = 0.25  # of a part's area: holes that may be closed for telling inside from outside
_THIN = 2e-6  # longest sides that a sheet is thick, for it to be cut
_UNNAMED = 1 << 30  # numbers from here on are of faces that the mesh does not have
_MOST_PARTS = 2000  # of a mesh; one with more is left as it is
_ROUNDS = 4  # of unions, each with fewer parts than the one before
_SEEN_LOST = 5e-4  # share of the places seen from outside that a union may lose
_ODD = "their surfaces are not sound enough to be united"
_WITHIN = 0.5  # winding number within a capped part


@dataclass(frozen=True)
class United:
    """vertices (v, 3), outward faces (f, 3) and the face (f,) that each is a piece of.
    covered: area that other parts covered, in the vertices' unit squared; parts: how many there
    were. left: why parts were left as they are, in words; empty where all were united."""

    vertices: np.ndarray
    faces: np.ndarray
    origin: np.ndarray
    covered: float
    parts: int
    left: str = ""


def united(vertices: np.ndarray, faces: np.ndarray) -> United:
    """The outer surface of the union of a mesh's closed parts, and open ones outside of them.

    vertices: (v, 3); faces: (f, 3), outward. Parts with small holes count as closed. What lies
    inside a closed part is removed, exactly where the surfaces cross; parts that touch become one.
    Nothing that can be seen from outside goes: where it would, parts keep their holes open, and
    those that lose something still are left as they are.
    """
    given = United(vertices, faces, np.arange(len(faces)), 0.0, 0)
    vertices, faces, origin = sewn_borders(vertices, faces)
    vertices, faces, source = crowded_edges_divided(vertices, faces)
    origin = origin[source]
    parts = _parts(vertices, faces)
    if len(parts) > _MOST_PARTS:
        left = f"{len(parts)} parts left as they overlap: at most {_MOST_PARTS} are united"
        return replace(given, left=left)
    if len(parts) == 1:
        return given
    bodies = [_body(vertices, part, _CAP) for part in parts]
    seen = Seen.of(vertices, faces, np.random.default_rng(0))
    of_face = np.zeros(len(faces), np.int64)
    for number, part in enumerate(parts):
        of_face[part.name] = number
    own = of_face[seen.faces]
    for _ in range(_ROUNDS):
        made = _union(vertices, faces, bodies)
        if made is None:
            break
        lost = seen.lost(made.vertices, made.faces)
        if lost.sum() <= _SEEN_LOST * len(lost):
            covered = max(
                float(triangle_areas(given.vertices, given.faces).sum())
                - float(triangle_areas(made.vertices, made.faces).sum()),
                0,
            )
            odd = sum(body.solid is None and body.sheet is None for body in bodies)
            left = f"{odd} of {len(parts)} parts left as they overlap: {_ODD}" if odd else ""
            return replace(made, origin=origin[made.origin], covered=float(covered), left=left)
        hiding = _hiding(bodies, seen.points[lost], own[lost])
        for number in hiding:
            bodies[number] = _body(vertices, parts[number], 0.0)
        for number in [] if hiding else np.unique(own[lost]):
            bodies[number] = _Body(parts[number], None, None)
    if all(body.solid is None for body in bodies):
        return given  # open sheets cover nothing
    return replace(given, left=f"{len(parts)} parts left as they overlap: {_ODD}")


@dataclass(frozen=True)
class _Part:
    """Faces (f, 3) that hang together, of the vertices (v,) of the mesh, and which faces (f,) of
    the mesh they are."""

    place: np.ndarray
    faces: np.ndarray
    name: np.ndarray
    is_open: bool


@dataclass(frozen=True)
class _Body:
    """A part as a solid, or as a sheet with a back, or as neither. closed: vertices and faces of
    the part with its holes capped, if it has some."""

    part: _Part
    solid: manifold3d.Manifold | None
    sheet: manifold3d.Manifold | None
    closed: tuple[np.ndarray, np.ndarray] | None = None


def _parts(vertices: np.ndarray, faces: np.ndarray) -> list[_Part]:
    opposite = paired_half_edges(vertices, faces)
    part = part_numbers(opposite)
    split, place = split_vertices(faces, opposite)
    is_open = np.zeros(int(part.max()) + 1, bool)
    is_open[part[np.flatnonzero(opposite < 0) // 3]] = True
    order = np.argsort(part, kind="stable")
    parts = []
    for number, own in enumerate(np.split(order, np.cumsum(np.bincount(part))[:-1])):
        used, local = np.unique(split[own], return_inverse=True)
        parts.append(_Part(place[used], local.reshape(-1, 3), own, bool(is_open[number])))
    return parts


def _body(vertices: np.ndarray, part: _Part, cap: float) -> _Body:
    """A part as a body; holes up to a share of its area are capped."""
    places, faces = vertices[part.place], part.faces
    closed = None
    if not part.is_open:
        solid = _manifold(places, faces, part.name)
    else:
        closed = capped(places, faces, cap) if cap else None
        solid = _manifold(*closed, part.name) if closed else None
    if solid is not None or closed is not None or not part.is_open:
        sound = solid is not None and solid.volume() >= 0.0
        return _Body(part, solid if sound else None, None, closed if sound else None)
    thin = _THIN * float(np.ptp(vertices, axis=0).max())
    sheet = _manifold(*thickened(places, faces, thin), part.name)
    return _Body(part, None, sheet if sheet is not None and sheet.volume() >= 0.0 else None)


def _union(vertices: np.ndarray, faces: np.ndarray, bodies: list[_Body]) -> United | None:
    """The bodies as one surface; None where none is a solid, or nothing meets it."""
    solids = [body.solid for body in bodies if body.solid is not None]
    sheets = [body.sheet for body in bodies if body.sheet is not None]
    if not solids or len(solids) + len(sheets) < 2:
        return None
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    pieces = [_triangles(body) for body in (union, *(sheet - union for sheet in sheets))]
    rest = [body.part.name for body in bodies if body.solid is None and body.sheet is None]
    left = np.concatenate([np.zeros(0, np.int64), *rest])
    pieces.append((vertices, faces[left], left))
    shift = np.cumsum([0, *(len(piece[0]) for piece in pieces[:-1])])
    vertices = np.concatenate([piece[0] for piece in pieces])
    faces = np.concatenate([piece[1] + by for piece, by in zip(pieces, shift, strict=True)])
    origin = np.concatenate([piece[2] for piece in pieces])
    vertices, faces, origin = without_slivers(vertices, faces, origin)
    once = each_once(faces)
    faces, origin = faces[once], origin[once]
    used, faces = np.unique(faces, return_inverse=True)
    return United(vertices[used], faces.reshape(-1, 3), origin, 0.0, len(solids) + len(sheets))


def _hiding(bodies: list[_Body], points: np.ndarray, own: np.ndarray) -> list[int]:
    """Which bodies with capped holes hold points (n, 3) of other parts, own (n,)."""
    hiding = []
    for number, body in enumerate(bodies):
        if body.closed is None:
            continue
        vertices, faces = body.closed
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        asked = points[((points > low) & (points < high)).all(axis=1) & (own != number)]
        if len(asked):
            winding = igl.winding_number(vertices, np.ascontiguousarray(faces), asked)
            if (np.asarray(winding) > _WITHIN).any():
                hiding.append(number)
    return hiding


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
