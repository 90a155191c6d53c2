"""A mesh as it comes, made fit for planning: the outer skin, and what was changed, in words."""

from __future__ import annotations

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.errors import DataError
from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.loose_triangles import SAME_PLACE, check_surface, count_loose
from nrdf.geometry.mesh import (
    check_coordinate_range,
    check_mesh,
    clean_mesh,
    outer_skin,
    triangle_crosses,
)
from nrdf.geometry.winding import MeshWindingNumber
from nrdf.surface.mesh_needles import without_needles
from nrdf.surface.mesh_sewing import sheets_apart
from nrdf.surface.mesh_union import united

_VIEWED = 20_000  # points of the skin that say which way its parts look
_OFF = 1e-4  # longest sides above a face from where it is asked whether that is inside
_INSIDE = 0.6  # winding number from which a place is inside; half-way is on the surface
_WIDE, _MOST_ASKED = 10.0, 1_500  # radii that a face has at least; faces that stand for all
_NOTHING = 1e-6  # longest sides squared, an area that is not worth a word
_CROSSINGS = 12  # of a ray with the surface
_PLACES = np.array(
    [[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2], [5.6, 0.2, 0.2], [0.2, 5.6, 0.2], [0.2, 0.2, 5.6]]
)
_LOOSE = 0.5  # share of faces that touch no other from which vertices are sewn


def repaired_skin(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Vertices (v, 3), outward faces (f, 3) of the outer skin, and the repairs, in words.

    Raises DataError for what is no surface: no face with an area, nothing that is seen from
    outside, or what `nrdf.geometry.loose_triangles.check_surface` refuses.
    """
    vertices, faces = check_mesh(vertices, faces)
    check_coordinate_range(vertices)
    given = len(faces)
    vertices, faces = clean_mesh(vertices, faces)
    repairs: list[str] = []
    if len(faces) < given:
        repairs.append(_said(given - len(faces), "without area or given twice", "removed"))
    check_surface(vertices, faces)
    loose = count_loose(faces, 1)
    if loose > _LOOSE * len(faces) and len(faces) > 1:
        vertices, faces = clean_mesh(*_sewn(vertices, faces))
        if (left := count_loose(faces, 1)) < loose:
            repairs.append(_said(loose - left, "that touched no other", "sewn to their neighbours"))
    before = faces
    faces = outer_skin(vertices, faces, _VIEWED, np.random.default_rng(0))[0]
    turned = int((faces != before).any(axis=1).sum())
    if turned:
        repairs.append(_said(turned, "", "turned outwards"))
    made = united(vertices, faces)
    if made.covered > _NOTHING * float(np.ptp(vertices, axis=0).max()) ** 2:
        repairs.append(
            f"{made.parts} parts united, of which others covered {1e4 * made.covered:.3g} cm²"
        )
    repairs += [made.left] if made.left else []
    vertices, faces = made.vertices, made.faces
    hidden = hidden_faces(vertices, faces)
    if hidden.all():
        raise DataError("no face of the mesh can be reached from outside")
    if hidden.any():
        repairs.append(_said(int(hidden.sum()), "inside the object", "removed"))
    if crossing := _crossing(vertices, faces, hidden):
        repairs.append(
            f"{_said(crossing, 'that cross', 'others')} of the object left as they are: the mesh "
            "crosses itself there"
        )
    faces = faces[~hidden]
    used = len(np.unique(faces))
    vertices, faces = sheets_apart(vertices, faces)
    if len(vertices) > used:
        repairs.append(f"{len(vertices) - used} vertices doubled where more than two faces met")
    faces, _, cracks = without_needles(vertices, faces)
    if cracks.any():
        repairs.append(_said(int(cracks.sum()), "without area", "removed"))
    kept, faces = np.unique(faces, return_inverse=True)
    return vertices[kept], faces.reshape(-1, 3), tuple(repairs)


def hidden_faces(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which outward faces (f,) lie inside the object as a whole, as those of overlapping parts.

    Rays from seven places of such a face leave more parts than they enter, and the winding number
    above its middle is that of the inside.
    """
    corners = vertices[faces]
    normals = unit_vectors(triangle_crosses(vertices, faces))
    above = _OFF * float(np.ptp(vertices, axis=0).max()) * normals
    tree = igl.AABB()
    tree.init(vertices, faces)
    hidden = np.ones(len(faces), bool)
    for weights in _PLACES / _PLACES.sum(axis=1, keepdims=True):
        asked = np.flatnonzero(hidden)
        places = np.einsum("c,fca->fa", weights, corners[asked]) + above[asked]
        hidden[asked] = _leaving(tree, vertices, faces, normals, places, normals[asked])
    if hidden.any():
        # The slow and sure way, for what open parts do to rays.
        places = corners[hidden].mean(axis=1) + above[hidden]
        hidden[hidden] = MeshWindingNumber(vertices, faces)(places) > _INSIDE
    return hidden


def _crossing(vertices: np.ndarray, faces: np.ndarray, hidden: np.ndarray) -> int:
    """How many faces that are not hidden (f,) are inside the object in part, of a mesh in which
    parts that cross each other were united: about, where there are many faces."""
    corners = vertices[faces]
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).sum(axis=1)
    crosses = triangle_crosses(vertices, faces)
    off = _OFF * float(np.ptp(vertices, axis=0).max())
    # A place above a small face by an inner corner is in the wall beside it.
    large = np.linalg.norm(crosses, axis=1) > _WIDE * off * sides
    able = np.flatnonzero(large & ~hidden)
    asked = able[np.linspace(0, len(able) - 1, min(_MOST_ASKED, len(able))).astype(int)]
    if not len(asked):
        return 0
    above = off * unit_vectors(crosses[asked])
    weights = _PLACES[:4] / _PLACES[:4].sum(axis=1, keepdims=True)
    places = np.einsum("pc,fca->pfa", weights, corners[asked]) + above
    winding = MeshWindingNumber(vertices, faces)(places.reshape(-1, 3)).reshape(4, -1)
    inside = (winding > _INSIDE).any(axis=0)
    return round(int(inside.sum()) * len(able) / len(asked))


def _leaving(
    tree: igl.AABB,
    vertices: np.ndarray,
    faces: np.ndarray,
    normals: np.ndarray,
    places: np.ndarray,
    directions: np.ndarray,
) -> np.ndarray:
    """Whether rays (m,) from places (m, 3) leave more surfaces than they enter."""
    total = np.zeros(len(places), np.int64)
    going = np.arange(len(places))
    origins = places.copy()
    step = 1e-9 * float(np.ptp(vertices, axis=0).max())
    for _ in range(_CROSSINGS):
        ways = np.ascontiguousarray(directions[going])
        face, away, _ = tree.intersect_ray_first(
            vertices, faces, np.ascontiguousarray(origins[going]), ways
        )
        hit = np.asarray(face) >= 0
        going, ways = going[hit], ways[hit]
        if not len(going):
            break
        facing = np.einsum("ma,ma->m", normals[np.asarray(face)[hit]], ways)
        total[going] += np.sign(facing).astype(np.int64)
        origins[going] += (np.asarray(away)[hit] + step)[:, None] * ways
    return np.asarray(total > 0)


def _sewn(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that are nearly in one place as one."""
    near = cKDTree(vertices).query_pairs(
        SAME_PLACE * float(np.ptp(vertices, axis=0).max()), output_type="ndarray"
    )
    links = coo_matrix((np.ones(len(near), bool), tuple(near.T)), (len(vertices),) * 2)
    place = connected_components(links, directed=False)[1]
    first = np.unique(place, return_index=True)[1]
    return vertices[first], place[faces]


def _said(count: int, which: str, done: str) -> str:
    noun = "face" if count == 1 else "faces"
    return f"{count} {noun} {which} {done}".replace("  ", " ")
