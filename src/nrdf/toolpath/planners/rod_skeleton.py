"""Skeleton of a part: the axes of its rods, and the triangles that belong to each.

The long chains of its Reeb graph are rods. Chains that go on straight through a junction are one
rod; a rod with a sharp bend is two.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from nrdf.geometry.frames import unit_vectors
from nrdf.geometry.polylines import resample, total_length
from nrdf.surface.fine_mesh import FineMesh
from nrdf.toolpath.planners.reeb_graph import ReebGraph, reeb_graph

_LONG = 0.7  # of its section's length: a chain that is longer is a rod's
_STRAIGHT = 0.76  # cosine: chains that turn less at a junction go on there
_ALIKE = 2.5  # and whose sections' lengths differ by less than that factor
_BEND = 0.77  # cosine: a rod that turns more within its thickness is cut there
_SLANTED = 0.75  # thicknesses: so near an end or a junction, bands are not square to the rod
_SAMPLES = 0.25  # of a thickness, between points of an axis
_LED_ON = 4.0  # thicknesses that a rod goes on beyond its axis, at most
_ROUNDS = 4  # in which a triangle takes its neighbours' rod


@dataclass(frozen=True)
class Axis:
    """The axis of a rod: points (n, 3), m, at even steps; thickness_m: its section's length over
    pi."""

    points: np.ndarray
    thickness_m: float


def split_at_branches(
    mesh: FineMesh, touching: np.ndarray, least_m2: float
) -> tuple[list[Axis], np.ndarray]:
    """The axes of a mesh's rods, and the number (f,) of the axis that each triangle is nearest to.

    touching: pairs (p, 2) of triangles as of `touching_faces`; least_m2: of a rod's surface. No
    axis where nothing of the mesh is longer than its section is around.
    """
    graph = reeb_graph(mesh, touching)
    chains, cluster = _long_chains(graph, least_m2)
    if not chains:
        return [], np.full(len(mesh.faces), -1)
    axes: list[Axis] = []
    for rod in _joined(graph, chains, cluster):
        thick = float(np.median(graph.around[np.concatenate(rod)])) / np.pi
        middle = np.concatenate([_middle(chain, thick / graph.band_m) for chain in rod])
        for points in _cut_at_bends(_smooth(graph.centre[middle], thick), thick):
            axes.append(Axis(points, thick))
    axes = _without_shadows(axes)
    if len(axes) == 1:
        return axes, np.zeros(len(mesh.faces), int)
    return axes, _nearest_axis(mesh, axes)


def _middle(chain: np.ndarray, thick: float) -> np.ndarray:
    """A chain's nodes without those at its ends, where it meets others; thick: in bands."""
    trim = int(min(_SLANTED * thick, 0.25 * len(chain)))
    return chain[trim : len(chain) - trim]


def _long_chains(graph: ReebGraph, least_m2: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Nodes of each long chain, in order, and the cluster (n,) that other nodes are of; -1 on
    chains. Short dead ends are left out first, so that they don't cut a chain."""
    alive = np.ones(len(graph.centre), bool)
    known: dict[bytes, bool] = {}  # most chains stay as they are when a dead end goes

    def is_long(chain: np.ndarray) -> bool:
        key = chain.tobytes()
        if key not in known:
            known[key] = _is_long(graph, chain, least_m2)
        return known[key]

    while True:
        chains = _chains(graph, alive)
        degree = _degrees(graph, alive)
        short = [c for c in chains if not is_long(c)]
        dead = [c for c in short if min(degree[c[0]], degree[c[-1]]) <= 1 and len(chains) > 1]
        if not dead:
            break
        alive[min(dead, key=len)] = False
    long = [chain for chain in chains if is_long(chain)]
    rest = np.ones(len(alive), bool)
    for chain in long:
        rest[chain] = False
    inner = graph.links[rest[graph.links].all(axis=1)]
    count = len(alive)
    joined = coo_matrix((np.ones(len(inner)), tuple(inner.T)), (count, count))
    cluster = connected_components(joined, directed=False)[1]
    return long, np.where(rest, cluster, -1)


def _is_long(graph: ReebGraph, chain: np.ndarray, least_m2: float) -> bool:
    around = graph.around[chain]
    if float(around.sum()) * graph.band_m < least_m2:
        return False
    return bool(len(chain) * graph.band_m > _LONG * float(np.median(around)))


def _degrees(graph: ReebGraph, alive: np.ndarray) -> np.ndarray:
    links = graph.links[alive[graph.links].all(axis=1)]
    return np.bincount(links.ravel(), minlength=len(alive))


def _chains(graph: ReebGraph, alive: np.ndarray) -> list[np.ndarray]:
    """Chains of nodes with two neighbours at most, in order."""
    links = graph.links[alive[graph.links].all(axis=1)]
    degree = np.bincount(links.ravel(), minlength=len(alive))
    plain = alive & (degree <= 2)
    inner = links[plain[links].all(axis=1)]
    near: dict[int, list[int]] = defaultdict(list)
    for a, b in inner.tolist():
        near[a].append(b)
        near[b].append(a)
    left = set(np.flatnonzero(plain).tolist())
    found = []
    for start in sorted(left, key=lambda k: (len(near[k]), k)):
        if start not in left:
            continue
        chain = [start]
        left.discard(start)
        while following := [k for k in near[chain[-1]] if k in left]:
            chain.append(following[0])
            left.discard(following[0])
        found.append(np.array(chain))
    return found


def _joined(
    graph: ReebGraph, chains: list[np.ndarray], cluster: np.ndarray
) -> list[list[np.ndarray]]:
    """Rods: chains, so turned and ordered that each goes on where the one before ends."""
    near: dict[int, list[int]] = defaultdict(list)
    for a, b in graph.links.tolist():
        near[a].append(b)
        near[b].append(a)
    home = {int(node): number for number, chain in enumerate(chains) for node in chain}
    meets: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, chain in enumerate(chains):
        for end in (0, 1):
            node = int(chain[-end])
            beyond = [k for k in near[node] if home.get(k) != number]
            for place in {int(cluster[k]) for k in beyond if cluster[k] >= 0}:
                meets[place].append((number, end))
            for k in beyond:
                if cluster[k] < 0:  # two long chains that touch
                    meets[-1 - min(node, k)].append((number, end))
    partner: dict[tuple[int, int], tuple[int, int]] = {}
    for ends in meets.values():
        asked = []
        for i, one in enumerate(ends):
            for other in ends[i + 1 :]:
                ahead, on = _ahead(graph, chains, one), _ahead(graph, chains, other)
                sizes = [float(np.median(graph.around[chains[k]])) for k, _ in (one, other)]
                straight = float(-ahead @ on)
                if straight > _STRAIGHT and max(sizes) < _ALIKE * min(sizes):
                    asked.append((straight, one, other))
        for _, one, other in sorted(asked, reverse=True):
            if one not in partner and other not in partner and one[0] != other[0]:
                partner[one], partner[other] = other, one
    rods, left = [], set(range(len(chains)))
    free_first = sorted(left, key=lambda k: ((k, 0) in partner) + ((k, 1) in partner))
    for start in free_first:
        if start not in left:
            continue
        end = 1 if (start, 0) not in partner else 0
        rod, number = [], start
        while True:
            left.discard(number)
            rod.append(chains[number] if end == 1 else chains[number][::-1])
            if (number, end) not in partner or partner[number, end][0] not in left:
                break
            number, entered = partner[number, end]
            end = 1 - entered
        rods.append(rod)
    return rods


def _ahead(graph: ReebGraph, chains: list[np.ndarray], end: tuple[int, int]) -> np.ndarray:
    """The unit direction (3,) in which a chain leaves at one of its ends."""
    chain = chains[end[0]] if end[1] == 1 else chains[end[0]][::-1]
    thick = float(np.median(graph.around[chain])) / np.pi
    far = min(max(int(np.ceil(2.0 * thick / graph.band_m)), 2), len(chain) - 1)
    skip = 1 if len(chain) > 4 else 0
    return unit_vectors(
        (graph.centre[chain[-1 - skip]] - graph.centre[chain[max(-1 - far - skip, -len(chain))]])[
            None
        ]
    )[0]


def _smooth(points: np.ndarray, thick: float) -> np.ndarray:
    """A line (n, 3) at even steps without the wobble of its points."""
    step = max(_SAMPLES * thick, 1e-9)
    if len(points) < 2 or total_length(points) < step:
        return points
    even = resample(points, step)
    # The ends don't draw in: the line goes on straight beyond them.
    ends = 2 * min(8, len(even) - 1)
    padded = np.concatenate(
        [
            2 * even[0] - even[ends // 2 : 0 : -1],
            even,
            2 * even[-1] - even[-2 : -2 - ends // 2 : -1],
        ]
    )
    smooth = gaussian_filter1d(padded, 2.0, axis=0)[ends // 2 : ends // 2 + len(even)]
    return np.asarray(smooth)


def _cut_at_bends(points: np.ndarray, thick: float) -> list[np.ndarray]:
    """An axis cut where it turns sharply."""
    window = max(round(1.0 / _SAMPLES), 1)
    if len(points) < 2 * window + 1:
        return [points]
    step = unit_vectors(points[window:] - points[:-window])
    turn = np.einsum("na,na->n", step[window:], step[:-window])  # at point k + window
    # Next to an end a cut would leave no rod.
    turn[: max(window // 2, 1)], turn[len(turn) - window // 2 :] = 1.0, 1.0
    cuts = []
    while len(turn) and turn.min() < _BEND:
        k = int(np.argmin(turn))
        cuts.append(k + window)
        turn[max(k - 2 * window, 0) : k + 2 * window + 1] = 1.0
    pieces = np.split(points, sorted(cuts))
    for k in range(len(pieces) - 1):
        pieces[k] = np.concatenate([pieces[k], pieces[k + 1][:1]])
    return [piece for piece in pieces if len(piece) > 1]


def _without_shadows(axes: list[Axis]) -> list[Axis]:
    """Axes without those of slivers that run within a larger rod, as along a slit."""
    kept: list[Axis] = []
    for axis in sorted(axes, key=lambda a: -a.thickness_m * total_length(a.points)):
        if not any(
            axis.thickness_m < 0.5 * other.thickness_m
            and (cKDTree(other.points).query(axis.points)[0] < 0.8 * other.thickness_m).mean() > 0.7
            for other in kept
        ):
            kept.append(axis)
    return kept


def _nearest_axis(mesh: FineMesh, axes: list[Axis]) -> np.ndarray:
    """The axis (f,) that each triangle is nearest to, in thicknesses of its rod."""
    away = np.stack(
        [cKDTree(_led_on(axis, axes)).query(mesh.centres)[0] / axis.thickness_m for axis in axes],
        axis=1,
    )
    number = away.argmin(axis=1)
    _, of_face = mesh.edges
    rows = np.repeat(np.arange(len(mesh.faces)), 3)
    uses = csr_matrix((np.ones(len(rows)), (rows, of_face.ravel())))
    beside = uses @ uses.T
    for _ in range(_ROUNDS):
        votes = beside @ np.eye(len(axes))[number]
        number = votes.argmax(axis=1)
    return np.asarray(number)


def _led_on(axis: Axis, axes: list[Axis]) -> np.ndarray:
    """The points (n, 3) of an axis, led on straight up to the rods that it meets."""
    others = [other for other in axes if other is not axis]
    near = min(8, len(axis.points) - 1)
    far = np.arange(1, round(_LED_ON / _SAMPLES) + 1)[:, None] * _SAMPLES * axis.thickness_m
    pieces = [axis.points]
    for end, inner in ((0, near), (-1, -1 - near)):
        ahead = unit_vectors((axis.points[end] - axis.points[inner])[None])
        beyond = axis.points[end] + far * ahead
        free = np.ones(len(beyond), bool)
        for other in others:
            free &= cKDTree(other.points).query(beyond)[0] > other.thickness_m
        pieces.append(beyond[np.logical_and.accumulate(free)])
    return np.concatenate(pieces)
