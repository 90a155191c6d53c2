"""Triangle meshes: checking, cleaning, and the outer skin with faces turned outwards.

Meshes in practice have faces of either winding, faces given twice (once for each side), parts that
overlap, and insides (cabins, double shells) that no sensor ever sees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.errors import DataError
from nrdf.geometry.visibility import visibility

MAX_FACES = 1_800_000
MAX_COORDINATE = 1e12
"""The largest coordinate that is read, in any unit; beyond it are damaged files only, and numbers
that cannot be squared."""
MIN_VIEWS = 3  # a point belongs to the skin if this many of 40 directions see it
_HASH = np.uint64(0x9E3779B97F4A7C15)  # odd, with evenly spread bits
_PART = 1 << 17  # faces
_CLEAR_VOTE = 3.0  # sum of cosines above which visibility overrules a face's own orientation


@dataclass(frozen=True)
class Mesh:
    """Triangles as a file has them: vertices (v, 3) float64, faces (f, 3) of vertex indices."""

    vertices: np.ndarray
    faces: np.ndarray

    def scaled(self, factor: float) -> Mesh:
        """The same, larger by `factor`."""
        return Mesh(self.vertices * factor, self.faces)


@dataclass(frozen=True)
class Skin:
    """Points (n, 3) of a mesh that are seen from outside, with outward unit normals (n, 3), and the
    face (n,) that each lies on."""

    points: np.ndarray
    normals: np.ndarray
    face: np.ndarray


def triangle_crosses(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Along the normals (f, 3) of triangles, twice their areas long, of vertices (v, 3), faces
    (f, 3)."""
    a, b, c = (vertices[corner] for corner in faces.T)
    (x, y, z), (u, v, w) = (b - a).T, (c - a).T  # several times as fast as np.cross
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=1)


def triangle_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Areas (f,) of triangles, of vertices (v, 3), faces (f, 3)."""
    cross = triangle_crosses(vertices, faces)
    return np.sqrt(np.einsum("fa,fa->f", cross, cross)) / 2.0


def check_coordinate_range(points: np.ndarray) -> None:
    """Raise DataError for points (n, 3), finite, with coordinates beyond those of any object."""
    if (largest := max(points.max(initial=0.0), -points.min(initial=0.0))) > MAX_COORDINATE:
        raise DataError(
            f"has coordinates of {largest:.3g}; at most {MAX_COORDINATE:g} are read: it is "
            "damaged, or no object"
        )


def check_mesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The mesh as float64 (v, 3) and int64 (f, 3), in memory as native code wants them.

    Raises DataError where there is no face, or too many, a face names a vertex that does not exist,
    or a vertex that is used is not finite. Vertices that no face uses are moved onto one that is
    used.
    """
    vertices = np.array(vertices, dtype=np.float64, order="C")
    faces = np.ascontiguousarray(faces, dtype=np.int64)
    if not len(faces):
        raise DataError("the mesh has no faces")
    if vertices.ndim != 2 or faces.ndim != 2 or (vertices.shape[1], faces.shape[1]) != (3, 3):
        raise DataError(
            f"vertices {vertices.shape} and faces {faces.shape} must be (v, 3) and (f, 3)"
        )
    if len(faces) > MAX_FACES:
        raise DataError(f"{len(faces)} faces; at most {MAX_FACES} are used: simplify the mesh")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise DataError("a face names a vertex that does not exist")
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    if not np.isfinite(vertices[used]).all():
        raise DataError("the mesh has vertices that are NaN or infinite")
    vertices[~used] = vertices[faces[0, 0]]
    return vertices, faces


def row_keys(rows: np.ndarray) -> np.ndarray:
    """A number (n,) for each of rows (n, k) of float64, the same for the same row: a hash of 64
    bits, which is sorted much faster than the rows."""
    key = np.zeros(len(rows), dtype=np.uint64)
    for column in rows.T:
        bits = (column + 0.0).view(np.uint64)  # without negative zeros
        key ^= bits
        key ^= bits >> np.uint64(29)
        key *= _HASH
        key ^= key >> np.uint64(32)
    return key


def clean_mesh(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Merge equal vertices and drop faces without area, repeated faces and unused vertices.

    Without this a face that is given twice, once for each side, cancels itself: the winding number
    is 0 on both sides. Raises DataError if no face is left.
    """
    return clean_faces(vertices, faces)[:2]


def clean_faces(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `clean_mesh` gives, and which of the faces (f,) are left: (k,), ascending."""
    # Step by step, and faces in parts: meshes of millions of faces are usual.
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    faces = (np.cumsum(used) - 1)[faces]
    vertices = vertices[used]
    extent = float(np.ptp(vertices, axis=0).max())
    # Exactly equal ones only: a tolerance glues inner to outer walls, which turns the inner ones.
    key = row_keys(vertices)
    _, first, merged = np.unique(key, return_index=True, return_inverse=True)
    vertices, faces = vertices[first], merged[faces]
    del key, merged
    area = np.empty(len(faces))
    for start in range(0, len(faces), _PART):
        part = slice(start, start + _PART)
        a, b, c = (vertices[corner] for corner in faces[part].T)
        area[part] = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    kept = np.flatnonzero(area > 1e-14 * extent**2)
    faces = faces[kept]
    if len(faces) == 0:
        raise DataError("the mesh has no surface: no face has an area")
    low, middle, high = np.sort(faces, axis=1).T
    count = np.uint64(len(vertices))
    key = (low.astype(np.uint64) * count + middle.astype(np.uint64)) * count
    once = np.sort(np.unique(key + high.astype(np.uint64), return_index=True)[1])
    return vertices, faces[once], kept[once]


def outer_skin(
    vertices: np.ndarray, faces: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, Skin]:
    """Faces (f, 3) turned outwards, and `count` random points of the skin seen from outside.

    Points are drawn evenly over the area; those that fewer than 3 of 40 directions see are left
    out. Each consistently wound patch is turned as a whole, to the side that it is seen from
    (Takayama et al., 2014), hidden ones so that they enclose a positive volume. Raises DataError
    if too little of the surface is seen.
    """
    patch, flip = _patches(faces)
    faces = np.where(flip[:, None], faces[:, ::-1], faces)
    corners = vertices[faces]
    cross = triangle_crosses(vertices, faces)
    area = np.linalg.norm(cross, axis=1)
    cumulative = np.cumsum(area)
    if not cumulative[-1] > 0.0:
        raise DataError("the mesh has no surface: no face has an area")
    drawn = 3 * count
    for _ in range(4):
        face = np.searchsorted(cumulative, rng.random(drawn) * cumulative[-1])
        face = np.minimum(face, len(faces) - 1)
        first, second = rng.random((2, drawn, 1))
        first = np.sqrt(first)
        triangle = corners[face]
        points = triangle[:, 0] * (1 - first) + triangle[:, 1] * (first * (1 - second))
        points += triangle[:, 2] * (first * second)
        normals = cross[face] / area[face, None]
        vote, front, back = visibility(points, normals)
        skin = np.flatnonzero(np.maximum(front, back) >= MIN_VIEWS)
        if len(skin) >= count:
            break
        drawn *= 2
    else:
        raise DataError(f"only {len(skin)} of {len(points)} points of its surface are visible")

    patches = int(patch.max()) + 1
    seen_from = np.bincount(patch[face], vote, patches)
    seen = np.bincount(patch[face], front + back, patches)
    middle = vertices.mean(axis=0)
    volume = np.bincount(patch, ((corners.mean(axis=1) - middle) * cross).sum(axis=1), patches)
    inward = np.where(np.abs(seen_from) > 0.05 * seen, seen_from < 0.0, volume < 0.0)[patch]
    faces = np.where(inward[:, None], faces[:, ::-1], faces)

    skin = skin[:count]
    turned = np.where(inward[face[skin]], -1.0, 1.0)
    clear = np.abs(vote[skin]) > _CLEAR_VOTE
    sign = np.where(clear, np.sign(vote[skin]), turned)
    return faces, Skin(points[skin], sign[:, None] * normals[skin], face[skin])


def _patches(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Patch (f,) of each face, and whether it must be flipped (f,) to agree with its patch.

    Faces belong together across edges that exactly two share. The two sides of every face are
    nodes of a graph whose edges join sides that agree, so its components are oriented patches.
    """
    count = len(faces)
    tail, head = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    upwards = tail < head
    key = np.minimum(tail, head) * (int(faces.max()) + 1) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    start = np.flatnonzero(np.diff(key[order], prepend=-1))
    shared = np.diff(start, append=len(key)) == 2
    one, two = order[start[shared]], order[start[shared] + 1]
    disagree = upwards[one] == upwards[two]
    one, two = one // 3, two // 3
    tails = np.concatenate([one, one + count])
    heads = np.concatenate([two + count * disagree, two + count * ~disagree])
    graph = coo_matrix((np.ones(len(tails), dtype=bool), (tails, heads)), (2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    patch = np.minimum(label[:count], label[count:])
    return np.unique(patch, return_inverse=True)[1], label[:count] > label[count:]
