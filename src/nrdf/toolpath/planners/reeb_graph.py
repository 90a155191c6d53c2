"""Reeb graph of a mesh: the pieces of bands of equal distance from one end, and which meet.

Level set diagrams, Verroust and Lazarus 2000. A rod is a chain of pieces, each a ring.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from nrdf.surface.fine_mesh import FineMesh

_BAND, _LEAST_BANDS = 1.0, 12  # longest edges that a band is wide; and how many there are


@dataclass(frozen=True)
class ReebGraph:
    """centre: (n, 3) of each piece of a band; around: (n,) length of its section, m; links: (l, 2);
    band_m: how wide a band is."""

    centre: np.ndarray
    around: np.ndarray
    links: np.ndarray
    band_m: float


def touching_faces(mesh: FineMesh) -> np.ndarray:
    """Pairs (p, 2) of triangles whose borders touch without a common edge: seams of a mesh."""
    pairs, of_face = mesh.edges
    single = np.bincount(of_face.ravel(), minlength=len(pairs)) == 1
    face, side = np.nonzero(single[of_face])
    if not len(face):
        return np.zeros((0, 2), int)
    ends = mesh.vertices[pairs[of_face[face, side]]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    step = 0.25 * mesh.edge_m
    count = np.maximum(np.ceil(length / step).astype(int), 1)
    of = np.repeat(np.arange(len(face)), count)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[of]
    places = ends[of, 0] + share[:, None] * (ends[of, 1] - ends[of, 0])
    near = cKDTree(places).query_pairs(0.5 * step, output_type="ndarray")
    touch = np.unique(np.sort(face[of[near]], axis=1), axis=0)
    return touch[touch[:, 0] != touch[:, 1]]


def reeb_graph(mesh: FineMesh, touching: np.ndarray) -> ReebGraph:
    """Pieces of bands: parts of triangles between two levels, glued along the edges they share."""
    pairs, of_face = mesh.edges
    away, band = _distance_from_an_end(mesh, touching)
    corner = away[mesh.faces]
    low, high = (np.floor(c / band).astype(int) for c in (corner.min(axis=1), corner.max(axis=1)))
    count = high - low + 1
    first = np.cumsum(count) - count  # number of each triangle's lowest piece
    face = np.repeat(np.arange(len(mesh.faces)), count)
    level = np.arange(len(face)) - first[face] + low[face]
    edge_low, edge_high = (
        np.floor(c / band).astype(int) for c in (away[pairs].min(axis=1), away[pairs].max(axis=1))
    )
    edge_first = np.cumsum(edge_high - edge_low + 1) - (edge_high - edge_low + 1)
    glue: list[np.ndarray] = []
    total = len(face)
    for side in range(3):
        edge = of_face[face, side]
        on = (level >= edge_low[edge]) & (level <= edge_high[edge])
        number = total + edge_first[edge] + level - edge_low[edge]
        glue.append(np.stack([np.flatnonzero(on), number[on]], axis=1))
    for near, far in ((0, 1), (1, 0)):
        # A seam glues what touches there, in the bands that both triangles have.
        a, b = touching[:, near], touching[:, far]
        for shift in range(int(count[a].max(initial=0))):
            there = (low[a] + shift <= high[a]) & (low[a] + shift >= low[b])
            there &= low[a] + shift <= high[b]
            glue.append(
                np.stack([first[a] + shift, first[b] + low[a] + shift - low[b]], axis=1)[there]
            )
    joined = np.concatenate(glue)
    size = total + int((edge_high - edge_low + 1).sum())
    net = coo_matrix((np.ones(len(joined), bool), tuple(joined.T)), (size, size))
    _, node = np.unique(connected_components(net, directed=False)[1][:total], return_inverse=True)
    number = int(node.max()) + 1
    # The section in the middle of each band: its length, and its centre.
    middle = (level + 0.5) * band
    one, other, crossed = crossings(mesh, away, face, middle)
    length = np.where(crossed, np.linalg.norm(other - one, axis=1), 0.0)
    around = np.bincount(node, length, minlength=number)
    weight = length + 1e-9 * band  # what no section cuts still has a place
    centre = (
        np.stack(
            [
                np.bincount(node, weight * 0.5 * (one + other)[:, a], minlength=number)
                for a in range(3)
            ],
            axis=1,
        )
        / np.bincount(node, weight, minlength=number)[:, None]
    )
    up = np.flatnonzero(face[1:] == face[:-1])
    links = np.unique(np.sort(np.stack([node[up], node[up + 1]], axis=1), axis=1), axis=0)
    return ReebGraph(centre, around, links, band)


def crossings(
    mesh: FineMesh, values: np.ndarray, face: np.ndarray, level: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Both ends (n, 3), m, of the line at which values (v,) are `level` (n,) on triangles (n,), and
    whether there is one (n,)."""
    corner, row = values[mesh.faces[face]], np.arange(len(face))
    order = np.argsort(corner, axis=1)
    value = np.take_along_axis(corner, order, axis=1)
    place = mesh.vertices[np.take_along_axis(mesh.faces[face], order, axis=1)]

    def between(a: np.ndarray | int, b: np.ndarray | int) -> np.ndarray:
        rise = value[row, b] - value[row, a]
        way = np.clip((level - value[row, a]) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)
        return np.asarray(place[row, a] + way[:, None] * (place[row, b] - place[row, a]))

    upper = (level > value[:, 1]).astype(int)
    crossed = (value[:, 0] < level) & (level <= value[:, 2])
    return between(0, 2), between(upper, upper + 1), crossed


def _distance_from_an_end(mesh: FineMesh, touching: np.ndarray) -> tuple[np.ndarray, float]:
    """Distance (v,) along the edges from an end of the mesh, m, and the width of a band."""
    pairs, _ = mesh.edges
    if len(touching):
        one, other = mesh.faces[touching[:, 0]], mesh.faces[touching[:, 1]]
        over = [np.stack([one[:, a], other[:, b]], 1) for a in range(3) for b in range(3)]
        pairs = np.unique(np.sort(np.concatenate([pairs, *over]), axis=1), axis=0)
    length = np.linalg.norm(mesh.vertices[pairs[:, 0]] - mesh.vertices[pairs[:, 1]], axis=1)
    count = len(mesh.vertices)
    net = csr_matrix((np.maximum(length, 1e-9), (pairs[:, 0], pairs[:, 1])), (count, count))
    one_end = dijkstra(net, directed=False, indices=0)
    one_end = dijkstra(net, directed=False, indices=int(np.argmax(one_end)))
    far = float(one_end.max())
    band = min(_BAND * mesh.edge_m, far / _LEAST_BANDS)
    thick = float(mesh.mass[one_end > far - 3.0 * band].sum()) / (3.0 * band) / np.pi
    seeds = np.flatnonzero(one_end >= far - min(thick, 0.2 * far))
    return dijkstra(net, directed=False, indices=seeds, min_only=True), band
