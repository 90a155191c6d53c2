"""A mesh refined for planning: the same surface, in triangles that are small."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from nrdf.geometry.mesh import triangle_areas, triangle_crosses

MOST_FACES = 50_000
"""Faces of a refined mesh, about; larger regions are planned in larger triangles."""
_ROUNDS, _FLIPS, _FIRST_FLIPS = 24, 3, 12
_FEW = 0.02  # share of the faces that may have edges to turn still
_OF_SQUARE = 0.11  # of a square on the longest edge, what a triangle has about
_FLAT = 3e-7  # of the mesh's extent: two triangles that lie so flat are one face, cut anyhow


@dataclass(frozen=True)
class FineMesh:
    """A surface cut into small triangles: every one lies within one of the surface it came from.

    vertices: (v, 3), m; faces: (f, 3); origin: (f,) the face that each came from; edge_m: no edge
    is longer.
    """

    vertices: np.ndarray
    faces: np.ndarray
    origin: np.ndarray
    edge_m: float

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas (f,) of the faces, m²."""
        return 0.5 * np.linalg.norm(self._crossed, axis=1)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (f, 3) of the faces."""
        length = np.linalg.norm(self._crossed, axis=1, keepdims=True)
        return self._crossed / np.maximum(length, 1e-300)

    @cached_property
    def centres(self) -> np.ndarray:
        """Centres (f, 3) of the faces, m."""
        return np.asarray(self.vertices[self.faces].mean(axis=1))

    @cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Edges (e, 2) of two vertices, and the edges (f, 3) of each face, from each corner on."""
        return edges_of(self.faces)

    @cached_property
    def border(self) -> np.ndarray:
        """Vertices (b,) on edges of a single face."""
        pairs, of_face = self.edges
        return np.unique(pairs[np.bincount(of_face.ravel(), minlength=len(pairs)) == 1])

    def border_loops(self) -> tuple[list[np.ndarray], np.ndarray]:
        """The vertices (b,) of each border that hangs together, and the borders' lengths, m."""
        pairs, of_face = self.edges
        edge = pairs[np.bincount(of_face.ravel(), minlength=len(pairs)) == 1]
        used, ends = np.unique(edge, return_inverse=True)
        ends = ends.reshape(-1, 2)
        linked = csr_matrix((np.ones(len(ends)), ends.T), (len(used),) * 2)
        count, label = connected_components(linked, directed=False)
        step = np.linalg.norm(self.vertices[edge[:, 0]] - self.vertices[edge[:, 1]], axis=1)
        length = np.bincount(label[ends[:, 0]], step, minlength=count)
        return [used[label == k] for k in range(count)], length

    @cached_property
    def stiffness(self) -> csc_matrix:
        """Cotangent matrix (v, v), positive semi-definite, as `gradient` has it."""
        weight = csr_matrix((np.repeat(self.areas, 3), (np.arange(3 * len(self.faces)),) * 2))
        return csc_matrix(self.gradient.T @ weight @ self.gradient)

    @cached_property
    def memo(self) -> dict[Any, Any]:
        """What was worked out on the mesh before, by all that it depends on."""
        return {}

    @cached_property
    def mass(self) -> np.ndarray:
        """Area (v,) of each vertex, m²."""
        return np.bincount(
            self.faces.ravel(), np.repeat(self.areas / 3.0, 3), minlength=len(self.vertices)
        )

    @cached_property
    def gradient(self) -> csr_matrix:
        """Matrix (3 f, v) from values at the vertices to their gradient, 3 rows a face."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        double = np.maximum(2.0 * self.areas, 1e-300)[:, None]
        turned = [np.cross(self.normals, side) / double for side in (c - b, a - c, b - a)]
        rows = np.repeat(np.arange(3 * len(self.faces)).reshape(-1, 3), 3, axis=0)
        columns = np.repeat(self.faces.ravel(), 3).reshape(-1, 3)
        values = np.stack(turned, axis=1).reshape(-1, 3)
        shape = (3 * len(self.faces), len(self.vertices))
        return csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape)

    def slopes(self, values: np.ndarray) -> np.ndarray:
        """Gradients (f, 3) of values (v,) at the vertices."""
        return np.asarray(self.gradient @ values).reshape(-1, 3)

    def divergence(self, field: np.ndarray) -> np.ndarray:
        """Integrated divergence (v,) of a vector (f, 3) a face, as Poisson's equation has it."""
        return np.asarray(self.gradient.T @ (self.areas[:, None] * field).ravel())

    def components(self) -> list[FineMesh]:
        """The parts that hang together, largest first."""
        pairs, _ = self.edges
        count = len(self.vertices)
        linked = csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
        number, label = connected_components(linked, directed=False)
        if number == 1:
            return [self]
        of_face = label[self.faces[:, 0]]
        area = np.bincount(of_face, self.areas, minlength=number)
        order = np.argsort(-area, kind="stable")
        return [self.part(of_face == k) for k in order if area[k] > 0.0]

    def part(self, kept: np.ndarray) -> FineMesh:
        """The faces that are kept (f,) bool."""
        used, faces = np.unique(self.faces[kept], return_inverse=True)
        return FineMesh(self.vertices[used], faces.reshape(-1, 3), self.origin[kept], self.edge_m)

    @cached_property
    def _crossed(self) -> np.ndarray:
        return triangle_crosses(self.vertices, self.faces)


def refine(
    vertices: np.ndarray,
    faces: np.ndarray,
    edge_m: float,
    wanted: np.ndarray | None = None,
    most_faces: int = MOST_FACES,
) -> FineMesh:
    """Split the edges of a mesh (v, 3), (f, 3) until none is longer than `edge_m`.

    wanted: (f,) bool; with it, only faces that are, and the edges that others share with them.
    Where that would be too many triangles (`most_faces`), the edge is as much longer as needed.
    Thin triangles are cut across only, and flat neighbours share the best of their two diagonals.
    """
    origin = np.arange(len(faces))
    wanted = np.ones(len(faces), bool) if wanted is None else np.asarray(wanted)
    area = float(triangle_areas(vertices, faces[wanted]).sum())
    edge_m = max(edge_m, float(np.sqrt(area / (_OF_SQUARE * most_faces))))
    flat = _FLAT * float(np.ptp(vertices, axis=0).max())
    faces = _all_flipped(vertices, faces, flat, wanted, _FIRST_FLIPS)
    finished: list[tuple[np.ndarray, np.ndarray]] = []
    for _ in range(_ROUNDS):
        # Only faces with a long edge change, and that edge is long for both of its faces.
        edges = _Edges.of(faces)
        pairs, of_face = edges.pairs, edges.of_face
        long = np.zeros(len(pairs), bool)
        long[of_face[wanted[origin]]] = True
        length = _length(vertices[pairs[:, 0]] - vertices[pairs[:, 1]])
        long &= length > edge_m
        busy = long[of_face].any(axis=1)
        inner = _Inner.of(vertices, faces, edges, flat)
        long[inner.edge[inner.flat & (inner.height < 0.5 * edge_m)]] = False
        if not long.any():
            break
        finished.append((faces[~busy], origin[~busy]))
        middle = np.full(len(pairs), -1)
        middle[long] = len(vertices) + np.arange(int(long.sum()))
        vertices = np.concatenate([vertices, vertices[pairs[long]].mean(axis=1)])
        faces, source = split_edges(faces[busy], middle[of_face[busy]], vertices)
        origin = origin[busy][source]
        faces = _all_flipped(vertices, faces, flat, wanted[origin], 1)
    finished.append((faces, origin))
    faces, origin = (np.concatenate(kind) for kind in zip(*finished, strict=True))
    faces = _all_flipped(vertices, faces, flat, wanted[origin], _FLIPS)
    return FineMesh(vertices, faces, origin, edge_m)


def split_edges(
    faces: np.ndarray, middle: np.ndarray, vertices: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Faces (f, 3) with new vertices (f, 3) on their edges, -1 where none; and their sources."""
    cut = middle >= 0
    count = cut.sum(axis=1)
    whole = np.flatnonzero(count == 0)
    made, source = [faces[whole]], [whole]

    def add(index: np.ndarray, *corners: np.ndarray) -> None:
        made.append(np.stack(corners, axis=1))
        source.append(index)

    def turned(index: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, ...]:
        columns = (first[:, None] + np.arange(3)) % 3
        rows = index[:, None]
        return (*faces[rows, columns].T, *middle[rows, columns].T)

    index = np.flatnonzero(count == 1)
    a, b, c, ab, _, _ = turned(index, cut[index].argmax(axis=1))
    add(index, a, ab, c)
    add(index, ab, b, c)
    index = np.flatnonzero(count == 2)
    # The edge that stays whole is the last one, from c to a.
    a, b, c, ab, bc, _ = turned(index, ((~cut[index]).argmax(axis=1) + 1) % 3)
    add(index, ab, b, bc)
    one = np.linalg.norm(vertices[a] - vertices[bc], axis=1)
    other = np.linalg.norm(vertices[c] - vertices[ab], axis=1)
    near = one <= other
    add(index, a, ab, np.where(near, bc, c))
    add(index, np.where(near, a, ab), bc, c)
    index = np.flatnonzero(count == 3)
    a, b, c, ab, bc, ca = turned(index, np.zeros(len(index), int))
    for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)):
        add(index, *corners)
    return np.concatenate(made), np.concatenate(source)


@dataclass(frozen=True)
class _Edges:
    """Edges (e, 2) of two vertices, sorted; those of each face (f, 3), from each corner on; the
    edges (n,) of just two faces, and their half-edges (n,) in the one and in the other."""

    pairs: np.ndarray
    of_face: np.ndarray
    inner: np.ndarray
    one: np.ndarray
    other: np.ndarray

    @staticmethod
    def of(faces: np.ndarray) -> _Edges:
        tail, head = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        vertices = int(faces.max(initial=0)) + 1
        key = np.minimum(tail, head).astype(np.int64) * vertices + np.maximum(tail, head)
        order = np.argsort(key)
        key = key[order]
        new = np.ones(len(key), bool)
        new[1:] = key[1:] != key[:-1]
        number = np.empty(len(key), np.int64)
        number[order] = np.cumsum(new) - 1
        start = np.flatnonzero(new)
        inner = np.flatnonzero(np.diff(start, append=len(key)) == 2)
        one, other = order[start[inner]], order[start[inner] + 1]
        pairs = np.stack(np.divmod(key[start], vertices), axis=1)
        return _Edges(pairs, number.reshape(-1, 3), inner, one, other)


@dataclass(frozen=True)
class _Inner:
    """Edges (n,) between two faces f, g: a, b on the edge, c, d across; whether they lie flat, and
    the larger height of the two triangles on the edge. doubles (n, 2): twice their areas."""

    edge: np.ndarray
    faces: np.ndarray
    corners: np.ndarray
    flat: np.ndarray
    height: np.ndarray
    doubles: np.ndarray

    @staticmethod
    def of(vertices: np.ndarray, faces: np.ndarray, edges: _Edges, limit: float) -> _Inner:
        inner, one, other = edges.inner, edges.one, edges.other
        f, g = one // 3, other // 3
        a, b, c = (faces[f, (one + k) % 3] for k in range(3))
        d = faces[g, (other + 2) % 3]
        pa, pb, pc, pd = (vertices[corner] for corner in (a, b, c, d))
        side = pb - pa
        normal, beside = np.cross(side, pc - pa), np.cross(pd - pa, side)
        size, other_size = _length(normal), _length(beside)
        off = np.abs(np.einsum("ea,ea->e", normal, pd - pa)) / np.maximum(size, 1e-300)
        flat = (faces[g, other % 3] == b) & (off < limit) & (c != d)
        flat &= np.einsum("ea,ea->e", normal, beside) > 0.0
        height = np.maximum(size, other_size) / np.maximum(_length(side), 1e-300)
        corners = np.stack([a, b, c, d], axis=1)
        doubles = np.stack([size, other_size], axis=1)
        return _Inner(inner, np.stack([f, g], axis=1), corners, flat, height, doubles)


def _all_flipped(
    vertices: np.ndarray, faces: np.ndarray, flat: float, kind: np.ndarray, rounds: int
) -> np.ndarray:
    """Faces (f, 3) after some rounds of `_flipped`, fewer where hardly anything is left to turn."""
    faces, asked = _flipped(vertices, faces, flat, kind, np.ones(len(faces), bool))
    for _ in range(rounds - 1):
        if asked.sum() <= _FEW * len(faces):
            break
        # Edges change with the faces beside them, and all faces around tell which edges there are.
        touched = np.zeros(len(vertices), bool)
        touched[faces[asked]] = True
        near = np.flatnonzero(touched[faces].any(axis=1))
        faces[near], again = _flipped(vertices, faces[near], flat, kind[near], asked[near])
        asked = np.zeros(len(faces), bool)
        asked[near[again]] = True
    return faces


def _flipped(
    vertices: np.ndarray, faces: np.ndarray, flat: float, kind: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Faces (f, 3) with edges between flat neighbours of one kind (f,), of which one at least is
    wanted (f,), turned where that makes them less thin: Delaunay's criterion, for edges that share
    no triangle. Returns them, and those (f,) that changed or had no turn yet."""
    edges = _Edges.of(faces)
    inner = _Inner.of(vertices, faces, edges, flat)
    one, other = inner.faces.T
    asked = np.flatnonzero(inner.flat & (kind[one] == kind[other]) & (wanted[one] | wanted[other]))
    busy = np.zeros(len(faces), bool)
    pa, pb, pc, pd = (vertices[corner] for corner in inner.corners[asked].T)
    # The angles across the edge: their tangents are those of twice an area and a product.
    one = np.einsum("ea,ea->e", pa - pc, pb - pc)
    other = np.einsum("ea,ea->e", pa - pd, pb - pd)
    size, other_size = inner.doubles[asked].T
    wide = np.arctan2(size, one) + np.arctan2(other_size, other)
    chosen, wide = asked[wide > np.pi + 1e-6], wide[wide > np.pi + 1e-6]
    if not len(chosen):
        return faces, busy
    # An edge that is there already would get more than two faces.
    count = int(faces.max()) + 1
    c, d = np.sort(inner.corners[chosen, 2:].astype(np.int64), axis=1).T
    there = edges.pairs[:, 0] * count + edges.pairs[:, 1]
    place = np.minimum(np.searchsorted(there, c * count + d), len(there) - 1)
    _, first = np.unique(c * count + d, return_index=True)
    new = np.zeros(len(chosen), bool)
    new[first] = there[place[first]] != (c * count + d)[first]
    chosen, wide = chosen[new], wide[new]
    # Each takes its two faces, the widest first.
    f, g = inner.faces[chosen].T
    rank = np.empty(len(chosen), int)
    rank[np.argsort(-wide, kind="stable")] = np.arange(len(chosen))
    taken = np.full(len(faces), len(chosen))
    np.minimum.at(taken, f, rank)
    np.minimum.at(taken, g, rank)
    free = (taken[f] == rank) & (taken[g] == rank)
    busy[f], busy[g] = True, True
    a, b, c, d = inner.corners[chosen[free]].T
    faces = faces.copy()
    faces[f[free]] = np.stack([a, d, c], axis=1)
    faces[g[free]] = np.stack([d, b, c], axis=1)
    return faces, busy


def _length(rows: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("ea,ea->e", rows, rows))


def edges_of(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 2) of two vertices, and the edges (f, 3) of each face, from each corner on."""
    edges = _Edges.of(faces)
    return edges.pairs, edges.of_face
