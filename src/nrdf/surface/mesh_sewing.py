"""Parts of a mesh made closed: faces paired around their edges, cracks sewn, small holes capped."""

from __future__ import annotations

import igl
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.mesh import triangle_areas
from nrdf.surface.fine_mesh import edges_of, split_edges
from nrdf.surface.mesh_edges import boundary_loops, opposite_half_edges

_SAME = 1e-5  # longest sides within which border vertices and border edges are one
_MOST_BORDER = 50_000  # half-edges along borders; a mesh with more is not sewn
_ROUNDS = 4  # of vertices set onto border edges
_APART_ROUNDS = 6


def paired_half_edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """As `opposite_half_edges` (3 f,), and where more than two outward faces meet at an edge, each
    with the next one around it through the solid, so that parts that touch stay apart."""
    opposite = opposite_half_edges(faces)
    tail, head = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    open_ones = np.flatnonzero(opposite < 0)
    low, high = np.minimum(tail, head)[open_ones], np.maximum(tail, head)[open_ones]
    key = low * (int(faces.max(initial=0)) + 1) + high
    _, edge, count = np.unique(key, return_inverse=True, return_counts=True)
    many = count[edge] > 2
    half, edge = open_ones[many], edge[many]
    if not len(half):
        return opposite
    start = vertices[np.minimum(tail, head)[half]]
    along = vertices[np.maximum(tail, head)[half]] - start
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
    third = vertices[faces.reshape(-1)[half // 3 * 3 + (half + 2) % 3]] - start
    # An axis square to the edge, the same for all of its faces.
    least = np.eye(3)[np.abs(along).argmin(axis=1)]
    across = np.cross(along, least)
    angle = np.arctan2(
        np.einsum("ea,ea->e", third, np.cross(along, across)),
        np.einsum("ea,ea->e", third, across) * np.linalg.norm(across, axis=1),
    )
    forward = tail[half] < head[half]
    # The solid lies towards smaller angles from faces that run forward.
    order = np.lexsort((forward, -angle, edge))
    half, edge, forward = half[order], edge[order], forward[order]
    while len(half):
        first = np.flatnonzero(np.diff(edge, prepend=-1))
        size = np.diff(first, append=len(edge))
        after = np.arange(1, len(edge) + 1)
        after[first + size - 1] = first
        pairs = np.flatnonzero(forward & ~forward[after])
        if not len(pairs):
            break
        opposite[half[pairs]] = half[after[pairs]]
        opposite[half[after[pairs]]] = half[pairs]
        # Those around a pair are next to each other then.
        rest = opposite[half] < 0
        half, edge, forward = half[rest], edge[rest], forward[rest]
    return opposite


def crowded_edges_divided(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges of more than two faces divided at their middles, so that each pair of those faces can
    have an edge of its own. Returns vertices, faces and the face that each came from (f,)."""
    pairs, of_face = edges_of(faces)
    crowded = np.flatnonzero(np.bincount(of_face.ravel(), minlength=len(pairs)) > 2)
    middle = np.full(len(pairs), -1)
    middle[crowded] = len(vertices) + np.arange(len(crowded))
    vertices = np.concatenate([vertices, vertices[pairs[crowded]].mean(axis=1)])
    return vertices, *split_edges(faces, middle[of_face], vertices)


def part_numbers(opposite: np.ndarray) -> np.ndarray:
    """Number (f,), from 0, of the part that each face belongs to, by its half-edges' opposites."""
    inner = np.flatnonzero(opposite >= 0)
    count = len(opposite) // 3
    links = (np.ones(len(inner), bool), (inner // 3, opposite[inner] // 3))
    graph = coo_matrix(links, (count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def split_vertices(faces: np.ndarray, opposite: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces (f, 3) whose corners are one vertex only where faces meet at an edge, and the vertex
    (v,) that each new one is: no edge has more than two faces, no vertex more than one fan."""
    inner = np.flatnonzero(opposite >= 0)
    after = inner // 3 * 3 + (inner + 1) % 3
    other = opposite[inner]
    other_after = other // 3 * 3 + (other + 1) % 3
    links = (np.concatenate([inner, after]), np.concatenate([other_after, other]))
    graph = coo_matrix((np.ones(len(links[0]), bool), links), (faces.size, faces.size))
    number = connected_components(graph, directed=False)[1]
    place = np.zeros(int(number.max(initial=-1)) + 1, np.int64)
    place[number] = faces.reshape(-1)
    return number.reshape(-1, 3).astype(np.int64), place


def each_once(faces: np.ndarray) -> np.ndarray:
    """Which faces (k,) are left if those with the same corners, wound the same way, are one."""
    turn = faces.argmin(axis=1)[:, None] + np.arange(3)
    key = np.take_along_axis(faces, turn % 3, axis=1)
    return np.asarray(np.sort(np.unique(key, axis=0, return_index=True)[1]))


def sheets_apart(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and outward faces, of which no more than two have an edge and no two all corners.

    Where more meet, edges are divided and vertices doubled; of two faces back to back, one gets
    vertices of its own.
    """
    for _ in range(_APART_ROUNDS):
        count = len(faces)
        vertices, faces, _ = crowded_edges_divided(vertices, faces)
        faces, place = split_vertices(faces, paired_half_edges(vertices, faces))
        vertices = vertices[place]
        once = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)[1]
        back = np.ones(len(faces), bool)
        back[once] = False
        faces = faces.copy()
        corners = faces[back].ravel()
        faces[back] = len(vertices) + np.arange(len(corners)).reshape(-1, 3)
        vertices = np.concatenate([vertices, vertices[corners]])
        if len(faces) == count:
            break
    used, faces = np.unique(faces, return_inverse=True)
    return vertices[used], faces.reshape(-1, 3)


def sewn_borders(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cracks between faces closed: border vertices that nearly coincide become one, and border
    edges are divided where a border vertex lies on them.

    Returns vertices, faces and the face that each came from (f,).
    """
    origin = np.arange(len(faces))
    near = _SAME * float(np.ptp(vertices, axis=0).max())
    for _ in range(_ROUNDS):
        half = np.flatnonzero(opposite_half_edges(faces) < 0)
        if not 0 < len(half) <= _MOST_BORDER:
            break
        tail = faces.reshape(-1)[half]
        head = np.roll(faces, -1, axis=1).reshape(-1)[half]
        border = np.unique(np.concatenate([tail, head]))
        tree = cKDTree(vertices[border])
        pairs = tree.query_pairs(near, output_type="ndarray")
        if len(pairs):
            count = len(vertices)
            links = (np.ones(len(pairs), bool), (border[pairs[:, 0]], border[pairs[:, 1]]))
            label = connected_components(coo_matrix(links, (count, count)), directed=False)[1]
            first = np.full(int(label.max()) + 1, -1)
            first[label[::-1]] = np.arange(count)[::-1]
            faces = first[label][faces]
            good = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
            faces, origin = faces[good], origin[good]
            continue
        divided = _divided(vertices, faces, half, border, tree, near)
        if divided is None:
            break
        faces, source = divided
        origin = origin[source]
    return vertices, faces, origin


def _divided(
    vertices: np.ndarray,
    faces: np.ndarray,
    half: np.ndarray,
    border: np.ndarray,
    tree: cKDTree,
    near: float,
) -> tuple[np.ndarray, np.ndarray] | None:
    """Faces with their border half-edges divided at one border vertex that lies on each, and the
    faces that they came from; None where there is none. A face is divided once."""
    tail = faces.reshape(-1)[half]
    head = np.roll(faces, -1, axis=1).reshape(-1)[half]
    a, b = vertices[tail], vertices[head]
    length = np.linalg.norm(b - a, axis=1)
    found = tree.query_ball_point((a + b) / 2.0, length / 2.0 + near)
    edge = np.repeat(np.arange(len(half)), [len(one) for one in found])
    if not len(edge):
        return None
    vertex = border[np.concatenate([np.asarray(one, np.int64) for one in found])]
    along = (b - a)[edge] / np.maximum(length[edge], 1e-300)[:, None]
    away = vertices[vertex] - a[edge]
    at = np.einsum("ea,ea->e", away, along)
    off = np.linalg.norm(away - at[:, None] * along, axis=1)
    on = (off < near) & (at > near) & (at < length[edge] - near)
    # The corner across, or a face would get two equal vertices.
    on &= vertex != faces.reshape(-1)[half[edge] // 3 * 3 + (half[edge] + 2) % 3]
    edge, vertex, at = edge[on], vertex[on], at[on]
    middle = np.abs(at - length[edge] / 2.0)
    order = np.argsort(middle, kind="stable")
    _, first = np.unique(half[edge[order]] // 3, return_index=True)
    chosen = order[first]
    if not len(chosen):
        return None
    divided, place = half[edge[chosen]], vertex[chosen]
    row, side = divided // 3, divided % 3
    one, two, across = (faces[row, (side + k) % 3] for k in range(3))
    faces = faces.copy()
    faces[row] = np.stack([one, place, across], axis=1)
    new = np.stack([place, two, across], axis=1)
    return np.concatenate([faces, new]), np.concatenate([np.arange(len(faces)), row])


def capped(
    vertices: np.ndarray, faces: np.ndarray, largest_share: float
) -> tuple[np.ndarray, np.ndarray] | None:
    """A part with a fan of triangles over each of its holes: vertices, and faces, the caps last.
    None where the caps have more than a share of the part's area, or some hole is not simple."""
    caps, added = [], []
    for loop in boundary_loops(faces):
        if len(np.unique(loop)) < max(len(loop), 3):
            return None
        added.append(vertices[loop].mean(axis=0))
        middle = np.full(len(loop), len(vertices) + len(added) - 1)
        caps.append(np.stack([np.roll(loop, -1), loop, middle], axis=1))
    if not caps:
        return vertices, faces
    vertices = np.concatenate([vertices, added])
    cap = np.concatenate(caps)
    area = triangle_areas(vertices, faces).sum()
    if triangle_areas(vertices, cap).sum() > largest_share * area:
        return None
    return vertices, np.concatenate([faces, cap])


def thickened(
    vertices: np.ndarray, faces: np.ndarray, thickness: float
) -> tuple[np.ndarray, np.ndarray]:
    """An open part as a closed one: its faces, then those of its back and its rim."""
    normals = np.nan_to_num(np.asarray(igl.per_vertex_normals(vertices, faces)))
    half = np.flatnonzero(opposite_half_edges(faces) < 0)
    a, b = faces.reshape(-1)[half], np.roll(faces, -1, axis=1).reshape(-1)[half]
    count = len(vertices)
    rim = [np.stack([b, a, a + count], axis=1), np.stack([b, a + count, b + count], axis=1)]
    back = vertices - thickness * unit_vectors(normals)
    return np.concatenate([vertices, back]), np.concatenate([faces, faces[:, ::-1] + count, *rim])
