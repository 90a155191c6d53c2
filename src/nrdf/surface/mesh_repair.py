"""A mesh as it comes, made fit for planning: the outer skin, and what was changed, in words."""

from __future__ import annotations

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.errors import DataError
from nrdf.geometry.mesh import check_mesh, clean_mesh, outer_skin
from nrdf.geometry.winding import mesh_winding_numbers

_VIEWED = 20_000  # points of the skin that say which way its parts look
_OFF = 1e-4  # longest sides above a face from where it is asked whether that is inside
_INSIDE = 0.6  # winding number from which a place is inside; half-way is on the surface
_PLACES = np.array(
    [[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2], [5.6, 0.2, 0.2], [0.2, 5.6, 0.2], [0.2, 0.2, 5.6]]
)
_SAME_PLACE = 2e-6  # longest sides within which vertices of loose triangles are one
_LOOSE, _MANY_LOOSE = 0.5, 10_000  # share and number of faces that touch no other: no surface


def repaired_skin(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Vertices (v, 3), outward faces (f, 3) of the outer skin, and the repairs, in words.

    Raises DataError for what is no surface: no face with an area, nothing that is seen from
    outside, or many triangles that hardly any other touches.
    """
    vertices, faces = check_mesh(vertices, faces)
    given = len(faces)
    vertices, faces = clean_mesh(vertices, faces)
    repairs: list[str] = []
    if len(faces) < given:
        repairs.append(_said(given - len(faces), "without area or given twice", "removed"))
    loose = _loose(faces)
    if loose > _LOOSE * len(faces) and len(faces) > 1:
        sewn = _sewn(vertices, faces)
        vertices, faces = clean_mesh(*sewn)
        if (left := _loose(faces)) < loose:
            repairs.append(_said(loose - left, "that touched no other", "sewn to their neighbours"))
        loose = left
    if loose > _LOOSE * len(faces) and loose > _MANY_LOOSE:
        raise DataError(
            f"{loose} of its {len(faces)} triangles touch no other: that is no surface; "
            "merge its vertices, or give its points as a cloud"
        )
    before = faces
    faces = outer_skin(vertices, faces, _VIEWED, np.random.default_rng(0))[0]
    turned = int((faces != before).any(axis=1).sum())
    if turned:
        repairs.append(_said(turned, "", "turned outwards"))
    hidden = hidden_faces(vertices, faces)
    if hidden.all():
        raise DataError("no face of the mesh can be reached from outside")
    if hidden.any():
        repairs.append(_said(int(hidden.sum()), "inside the object", "removed"))
    faces = faces[~hidden]
    split, new = igl.split_nonmanifold(np.ascontiguousarray(faces))[:2]
    new = np.asarray(new).reshape(-1)
    if len(new) > len(np.unique(faces)):
        more = len(new) - len(np.unique(faces))
        repairs.append(f"{more} vertices doubled where more than two faces met")
    used, faces = np.unique(np.asarray(split), return_inverse=True)
    return vertices[new[used]], faces.reshape(-1, 3), tuple(repairs)


def hidden_faces(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Which outward faces (f,) lie inside the object as a whole, as those of overlapping parts."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    above = _OFF * float(np.ptp(vertices, axis=0).max()) * normals
    hidden = np.ones(len(faces), bool)
    for weights in _PLACES / _PLACES.sum(axis=1, keepdims=True):
        asked = np.flatnonzero(hidden)
        places = np.einsum("c,fca->fa", weights, corners[asked]) + above[asked]
        hidden[asked] = mesh_winding_numbers(vertices, faces, places) > _INSIDE
    return hidden


def _loose(faces: np.ndarray) -> int:
    """How many faces share no vertex with another."""
    count = np.bincount(faces.reshape(-1))
    return int((count[faces] == 1).all(axis=1).sum())


def _sewn(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices that are nearly in one place as one."""
    near = cKDTree(vertices).query_pairs(
        _SAME_PLACE * float(np.ptp(vertices, axis=0).max()), output_type="ndarray"
    )
    links = coo_matrix((np.ones(len(near), bool), tuple(near.T)), (len(vertices),) * 2)
    place = connected_components(links, directed=False)[1]
    first = np.unique(place, return_index=True)[1]
    return vertices[first], place[faces]


def _said(count: int, which: str, done: str) -> str:
    noun = "face" if count == 1 else "faces"
    return f"{count} {noun} {which} {done}".replace("  ", " ")
